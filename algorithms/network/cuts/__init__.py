"""Valid inequalities: what every design satisfies and no relaxation does by itself."""
