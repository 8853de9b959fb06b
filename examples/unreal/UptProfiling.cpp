#include "UptProfiling.h"

#include "ProfilingDebugging/CountersTrace.h"
#include "ProfilingDebugging/CpuProfilerTrace.h"

TRACE_DECLARE_FLOAT_COUNTER(UptStepMs, TEXT("libupt/Step ms"));
TRACE_DECLARE_FLOAT_COUNTER(UptContactMs, TEXT("libupt/Contact ms"));
TRACE_DECLARE_FLOAT_COUNTER(UptCorrectionsMs, TEXT("libupt/Corrections ms"));
TRACE_DECLARE_INT_COUNTER(UptCorrections, TEXT("libupt/Corrections"));
TRACE_DECLARE_FLOAT_COUNTER(UptErrorMm, TEXT("libupt/Error mm"));

namespace UptProfiling {

upt_status Step(upt::Scene &Scene, const upt::Input &Input, upt::span<float> Out) {
  TRACE_CPUPROFILER_EVENT_SCOPE(libupt_Step);
  const upt_status Status = Scene.step(Input, Out);
  SetCounters(Scene);
  return Status;
}

upt_status Frame(upt::FrameClock &Clock, upt::Scene &Scene, double Now,
                 upt::span<const upt_instrument> Instruments, upt::span<float> Out) {
  TRACE_CPUPROFILER_EVENT_SCOPE(libupt_Frame);
  const upt_status Status = Clock.frame(Scene, Now, Instruments, Out);
  if (Clock.landed()) {
    SetCounters(Scene);
  }
  return Status;
}

void SetCounters(const upt::Scene &Scene) {
  upt_scene_timing Timing;
  upt_scene_stats Stats;
  if (Scene.timing(Timing) != UPT_OK || Scene.stats(Stats) != UPT_OK) {
    return;
  }
  TRACE_COUNTER_SET(UptStepMs, Timing.step_ms);
  TRACE_COUNTER_SET(UptContactMs, Timing.contact_ms);
  TRACE_COUNTER_SET(UptCorrectionsMs, Timing.corrections_ms);
  TRACE_COUNTER_SET(UptCorrections, Stats.corrections);
  TRACE_COUNTER_SET(UptErrorMm, Stats.error_mm);
}

} // namespace UptProfiling
