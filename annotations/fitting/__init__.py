"""From documents to the pose of the tool: the fit, what data leave open, and the likely mistakes."""
