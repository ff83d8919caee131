"""Measured trials: files, registration, accuracy against the model, identification, virtual experiments."""
