# The supply's Modbus face, apart from the rest of the plant: libmodbus is linked by nobody else here.
imrig_library(imrig_plant_modbus
  SOURCES modbus_server.cc modbus_request.cc modbus_registers.cc modbus_tcp.cc modbus_rtu.cc
  LINK imrig_base PkgConfig::MODBUS fmt::fmt Threads::Threads)
