# Rotor bar, heat and losses.
foreach(name IN ITEMS rotor_skin_effect_test thermal_test losses_test imc_18k5_test)
  imrig_test(plant_${name} SOURCES ${name}.cc LINK imrig_plant)
endforeach()
