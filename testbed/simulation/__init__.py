"""One run from scenario to folder: stepped, recorded, summed up; and many of them."""
