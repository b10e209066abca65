"""Tables printed the other way round: language, layout, findings and grid."""
