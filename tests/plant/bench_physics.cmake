# Inverter, sensors, generator and faults.
foreach(name IN ITEMS fault_effects_test inverter_test sensor_effects_test mechanical_effects_test)
  imrig_test(plant_${name} SOURCES ${name}.cc LINK imrig_plant)
endforeach()
