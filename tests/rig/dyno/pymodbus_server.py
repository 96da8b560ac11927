"""Another implementation's server: a bench supply's registers that keep what is written. pymodbus_server.py PORT."""
import sys

from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.server import StartTcpServer

registers = [0] * 101
registers[1] = 60062  # pymodbus counts its blocks from 1
registers[11] = 4713
store = ModbusSlaveContext(hr=ModbusSequentialDataBlock(0, registers))
StartTcpServer(context=ModbusServerContext(slaves=store, single=True), address=("127.0.0.1", int(sys.argv[1])))
