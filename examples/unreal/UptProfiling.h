// What Unreal Insights shows of libupt: a scope around each call, and counters of what the last
// step and its stages took. Copy both files into a module that links libupt, and call these in
// place of the scene's own calls. Exceptions are off in Unreal: define UPT_NO_EXCEPTIONS in the
// module.
//
// Tested against stand-ins of Unreal's macros (tests/c/unreal), never in the engine itself.
#pragma once

#include "upt.hpp"

namespace UptProfiling {

/// `Scene::step` in the scope `libupt_Step`, on the thread that calls; then the counters.
upt_status Step(upt::Scene &Scene, const upt::Input &Input, upt::span<float> Out = {});

/// `FrameClock::frame` in the scope `libupt_Frame`; the counters where a step has landed. The step
/// runs on the scene's worker: the counters are its time, not the frame's.
upt_status Frame(upt::FrameClock &Clock, upt::Scene &Scene, double Now,
                 upt::span<const upt_instrument> Instruments, upt::span<float> Out);

/// Sets the counters `libupt/Step ms`, `Contact ms`, `Corrections ms`, `Corrections` and `Error mm`
/// from the last step.
void SetCounters(const upt::Scene &Scene);

} // namespace UptProfiling
