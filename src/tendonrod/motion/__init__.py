"""Motion out of the outer tube: any progressive motion, and follow-the-leader plans."""
