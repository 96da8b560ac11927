"""Another implementation's client against the emulated supply: reads, writes, and is refused. tcp PORT | rtu DEVICE."""
import sys

from pymodbus.client import ModbusSerialClient, ModbusTcpClient


def main() -> None:
    kind, where = sys.argv[1:]
    if kind == "tcp":
        client = ModbusTcpClient("127.0.0.1", port=int(where), timeout=20)
    else:
        client = ModbusSerialClient(where, baudrate=115200, timeout=5)
    assert client.connect()
    identity = client.read_holding_registers(0, 1, slave=1).registers[0]
    measured = client.read_holding_registers(10, 2, slave=1).registers
    assert not client.write_registers(8, [1500, 750], slave=1).isError()
    back = client.read_holding_registers(8, 2, slave=1).registers
    too_high = client.write_register(8, 6001, slave=1).exception_code
    read_only = client.write_register(10, 1, slave=1).exception_code
    print(identity, measured, back, too_high, read_only)
    client.close()


main()
