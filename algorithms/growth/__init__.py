"""Streets that grow from a grammar into real ground (CitySprout, CS)."""
