"""Sites split along streets until rows of parcels fit."""
