"""Street networks on a quad mesh by integer programming (CND section 4)."""
