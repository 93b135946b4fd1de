"""One file per kind of file: text becomes way-points in the file's own units and convention of rotation."""
