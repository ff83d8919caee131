"""The bench: devices behind common interfaces, tension control, safety, and a recorder that loses nothing."""
