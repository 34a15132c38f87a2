"""Blocks of Modbus registers, for acquisition and rig."""
