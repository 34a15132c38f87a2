"""The virtual rig: a plant that nobody has to fear, behind the registers of real devices."""
