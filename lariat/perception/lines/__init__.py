"""Lines in one image: segmentation, skeleton, ridge, fragments, and their pairing at crossings."""
