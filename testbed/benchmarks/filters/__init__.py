"""Force filters on six scenes."""
