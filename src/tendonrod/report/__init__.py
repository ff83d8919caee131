"""The report on the paper: its simulation results recomputed, beside what it prints and what its misprints do."""

from .reproduction import reproduce

__all__ = ["reproduce"]
