// What the calls of a SoftTissue3D share.
#pragma once

#include "godot_api.h"
#include "tissue.hpp"

#include <exception>
#include <memory>
#include <string>

struct SoftTissue {
  std::unique_ptr<Tissue> tissue;
  Effort effort;                                     // of the steps, from the next open on
  upt_instrument hold = upt::make<upt_instrument>(); // how the tool holds the tissue
  std::string message;                               // of the last failed call
};

// Runs what may throw: an engine knows no exceptions. The message is kept, and printed in the
// engine's console. False too where no bundle is open.
template <typename Run> inline bool guarded(SoftTissue *self, Run run) {
  try {
    run();
    return true;
  } catch (const std::exception &error) {
    self->message = error.what();
    godot_error(error.what());
    return false;
  }
}
template <typename Run> inline bool opened(void *instance, Run run) {
  auto *self = static_cast<SoftTissue *>(instance);
  return self->tissue && guarded(self, [&] { run(*self->tissue); });
}

inline void put(GDExtensionTypePtr result, bool done) {
  *static_cast<GDExtensionBool *>(result) = done;
}
inline double real(GDExtensionConstTypePtr argument) {
  return *static_cast<const double *>(argument);
}

// Calls of the tool (tool_calls.cpp), of one that changes the body (cut_calls.cpp), and of what
// holds it (bed_calls.cpp).
#define UPT_CALL(name)                                                                             \
  void name(void *instance, const GDExtensionConstTypePtr *arguments, GDExtensionTypePtr result)
UPT_CALL(press_sphere);
UPT_CALL(press_capsule);
UPT_CALL(press_box);
UPT_CALL(press_spatula);
UPT_CALL(hold);
UPT_CALL(release);
UPT_CALL(work_as);
UPT_CALL(tear_at);
UPT_CALL(undo);
UPT_CALL(changes);
UPT_CALL(outside);
UPT_CALL(cut_area);
UPT_CALL(removed);
UPT_CALL(hang);
UPT_CALL(torn);
UPT_CALL(lead);
#undef UPT_CALL
