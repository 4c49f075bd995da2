"""The ground under the feet."""
