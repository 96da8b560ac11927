# The libraries imrig stands on, all from Debian's packages. Each lives in one room: no other target may link it.
set(THREADS_PREFER_PTHREAD_FLAG ON)
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(CLI11 2 REQUIRED)
find_package(tomlplusplus 3.3 REQUIRED)
find_package(fmt 9 REQUIRED)
find_package(spdlog REQUIRED)
pkg_check_modules(MODBUS REQUIRED IMPORTED_TARGET libmodbus)
pkg_check_modules(NLOPT REQUIRED IMPORTED_TARGET nlopt_cxx)
pkg_check_modules(MATIO REQUIRED IMPORTED_TARGET matio)

# lcm.pc asks for glib's development files, which programs that only use LCM's own headers do not need.
find_library(LCM_LIBRARY lcm REQUIRED)
find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp REQUIRED)
find_program(LCM_GEN lcm-gen REQUIRED)
add_library(imrig::lcm INTERFACE IMPORTED)
target_link_libraries(imrig::lcm INTERFACE ${LCM_LIBRARY})
target_include_directories(imrig::lcm SYSTEM INTERFACE ${LCM_INCLUDE_DIR})

# SUNDIALS' package file pulls in MPI, PETSc and more; the two serial libraries suffice.
find_library(SUNDIALS_ARKODE_LIBRARY sundials_arkode REQUIRED)
find_library(SUNDIALS_NVECSERIAL_LIBRARY sundials_nvecserial REQUIRED)
add_library(imrig::sundials INTERFACE IMPORTED)
target_link_libraries(imrig::sundials INTERFACE ${SUNDIALS_ARKODE_LIBRARY} ${SUNDIALS_NVECSERIAL_LIBRARY})

# Forward-mode derivatives: only Ceres' header jet.h is used.
find_path(CERES_INCLUDE_DIR ceres/jet.h REQUIRED)
add_library(imrig::jet INTERFACE IMPORTED)
target_include_directories(imrig::jet SYSTEM INTERFACE ${CERES_INCLUDE_DIR})
target_link_libraries(imrig::jet INTERFACE Eigen3::Eigen)

if(BUILD_TESTING)
  find_package(GTest 1.12 REQUIRED)
  include(GoogleTest)
endif()
