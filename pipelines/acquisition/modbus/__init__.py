"""Modbus: lines, devices, replies, ring buffers, exclusive access."""
