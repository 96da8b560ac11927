#include "plant/sundials_integrator.h"

#include <arkode/arkode_erkstep.h>
#include <nvector/nvector_serial.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "plant/rk4_integrator.h"

namespace imrig::plant {
namespace {

constexpr long kStretchesBeforeRestart = 4096;
constexpr double kFirstStep_s = 60e-6;

void check(int flag, const char* call) {
  if (flag < 0)
    throw std::runtime_error(std::string("plant: ") + call + " failed with " + std::to_string(flag));
}

int right_hand_side(realtype /*t*/, N_Vector x, N_Vector dx, void* drive) {
  static_cast<const Drive*>(drive)->derivatives(N_VGetArrayPointer_Serial(x), N_VGetArrayPointer_Serial(dx));
  return 0;
}

}  // namespace

struct SundialsIntegrator::Solver {
  SUNContext context = nullptr;
  N_Vector y = nullptr;
  void* memory = nullptr;
  double stretch_s = 0.0;
  long stretches = 0;  // since the last restart
  std::size_t n = 0;

  ~Solver() {
    if (memory) ERKStepFree(&memory);
    if (y) N_VDestroy(y);
    if (context) SUNContext_Free(&context);
  }
};

SundialsIntegrator::SundialsIntegrator(const Drive& drive, double rtol, double atol)
    : drive_(drive), solver_(std::make_unique<Solver>()) {
  Solver& s = *solver_;
  s.n = drive.size();
  check(SUNContext_Create(nullptr, &s.context), "SUNContext_Create");
  s.y = N_VNew_Serial(static_cast<sunindextype>(s.n), s.context);
  if (!s.y) throw std::runtime_error("plant: N_VNew_Serial failed");
  const State start = drive.initial();
  std::copy_n(start.data(), s.n, N_VGetArrayPointer_Serial(s.y));
  s.memory = ERKStepCreate(right_hand_side, 0.0, s.y, s.context);
  if (!s.memory) throw std::runtime_error("plant: ERKStepCreate failed");
  check(ERKStepSetUserData(s.memory, const_cast<Drive*>(&drive)), "ERKStepSetUserData");
  check(ERKStepSStolerances(s.memory, rtol, atol), "ERKStepSStolerances");
  check(ERKStepSetTableNum(s.memory, ARKODE_DORMAND_PRINCE_7_4_5), "ERKStepSetTableNum");
  // A stop at the stop time is read through the interpolant: degree 0 (6.4.1) would hand back a value from
  // inside the step, 1 is exact there.
  check(ERKStepSetInterpolantDegree(s.memory, 1), "ERKStepSetInterpolantDegree");
  check(ERKStepSetMaxNumSteps(s.memory, 100000), "ERKStepSetMaxNumSteps");
  // The first step sets the solver's memory up; taken here, no later one allocates.
  State scratch = start;
  advance(scratch, kFirstStep_s, true);
}

SundialsIntegrator::~SundialsIntegrator() = default;

void SundialsIntegrator::advance(State& x, double duration_s, bool fresh) {
  Solver& s = *solver_;
  double* y = N_VGetArrayPointer_Serial(s.y);
  if (fresh || duration_s != s.stretch_s || s.stretches >= kStretchesBeforeRestart) {
    std::copy_n(x.data(), s.n, y);
    check(ERKStepReset(s.memory, 0.0, s.y), "ERKStepReset");
    s.stretch_s = duration_s;
    s.stretches = 0;
  }
  ++s.stretches;
  const double end = static_cast<double>(s.stretches) * duration_s;
  check(ERKStepSetStopTime(s.memory, end), "ERKStepSetStopTime");
  realtype reached = 0.0;
  int flag = 0;
  do {
    flag = ERKStepEvolve(s.memory, end, s.y, &reached, ARK_ONE_STEP);
    check(flag, "ERKStepEvolve");
  } while (flag != ARK_TSTOP_RETURN);
  std::copy_n(y, s.n, x.data());
}

std::unique_ptr<Integrator> make_integrator(const IntegratorConfig& config, const Drive& drive) {
  if (config.kind == IntegratorConfig::Kind::kRk4) return std::make_unique<Rk4Integrator>(drive);
  return std::make_unique<SundialsIntegrator>(drive, config.rtol, config.atol);
}

}  // namespace imrig::plant
