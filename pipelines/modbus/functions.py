"""Function codes of Modbus (Modbus Application Protocol 1.1b3, section 6)."""

READ_HOLDING, READ_INPUT, WRITE_SINGLE, WRITE_MULTIPLE = 3, 4, 6, 16
READ_WRITE, READ_FIFO = 23, 24
