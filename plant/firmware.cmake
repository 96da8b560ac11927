# DSP firmware on the plant, and the process imrig-emulator.
imrig_library(imrig_emulator_core
  SOURCES firmware.cc emulator/emulator.cc emulator/link_port.cc emulator/pace.cc
  LINK imrig_plant imrig_link_device imrig_link imrig_base)
imrig_program(imrig-emulator
  SOURCES emulator_main.cc LINK imrig_emulator_core imrig_plant_modbus CLI11::CLI11)
