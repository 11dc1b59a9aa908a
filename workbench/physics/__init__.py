"""What makes models: coils, forces, the linear motor, guideways, vehicles, propulsion. It knows nothing of control."""
