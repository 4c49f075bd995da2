"""How files are read and written: checked objects, YAML, tables, files that are whole or not
there.
"""
