"""Floor plans and game levels: room tilings on top of the network program (CND 5.2, CND-x 5.3)."""
