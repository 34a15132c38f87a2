"""The machine without its imperfections: geometry, rigid-body equations, measured motion."""
