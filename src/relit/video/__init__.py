"""A face relit in a video: tracked, lit in a frame that moves with it, and written with its sound."""
