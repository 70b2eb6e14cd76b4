"""The search for plans: a first one, better ones window by window, a bound beside it."""
