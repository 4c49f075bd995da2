"""An independent simulator of one vertical leg, the source of rigs for blind tests."""
