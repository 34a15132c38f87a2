"""The virtual rig: a simulated plant behind the registers of real devices."""
