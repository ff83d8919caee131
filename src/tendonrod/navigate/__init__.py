"""Navigate a phantom: sessions headless and deterministic (`session`), their records, and the service and its page."""
