// What a script asks of what holds the organ: a bed of ties between tissue and tool, which tear one
// by one, and support groups.
#include "soft_tissue.hpp"

/// A bed: the tissue within this radius (mm) of a place (m) is tied to the tool where that is now,
/// and goes with it. Stiffness (N/m) and tearing force (mN, 0: never) are those of all ties
/// together. Returns how many ties there are; a tool that is released takes them along.
void hang(void *instance, const GDExtensionConstTypePtr *arguments, GDExtensionTypePtr result) {
  auto &out = *static_cast<int64_t *>(result);
  out = 0;
  const auto *place = static_cast<const float *>(arguments[0]);
  const float metres = 0.001F;
  const float centre[3] = {place[0] / metres, -place[2] / metres, place[1] / metres};
  opened(instance, [&](Tissue &tissue) {
    out = static_cast<int64_t>(tissue.hang(centre, static_cast<float>(real(arguments[1])),
                                           static_cast<float>(real(arguments[2])),
                                           static_cast<float>(real(arguments[3]))));
  });
}

/// Ties of the bed that have torn until the last step.
void torn(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<int64_t *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = static_cast<int64_t>(tissue.torn()); });
}

/// A support group of the bundle goes on from where it was meshed, as a rigid body (place in m), in
/// every step from now on; with `let_go` it holds nothing until it is led again.
void lead(void *instance, const GDExtensionConstTypePtr *arguments, GDExtensionTypePtr result) {
  const auto *position = static_cast<const float *>(arguments[1]),
             *rotation = static_cast<const float *>(arguments[2]);
  put(result, opened(instance, [&](Tissue &tissue) {
        const float metres = 0.001F;
        auto group = upt::make<upt_support>();
        group.group = static_cast<std::uint32_t>(*static_cast<const int64_t *>(arguments[0]));
        group.position[0] = position[0] / metres;
        group.position[1] = -position[2] / metres;
        group.position[2] = position[1] / metres;
        // The same rotation about RAS's axes.
        group.rotation[0] = rotation[0];
        group.rotation[1] = -rotation[2];
        group.rotation[2] = rotation[1];
        group.rotation[3] = rotation[3];
        group.let_go = *static_cast<const GDExtensionBool *>(arguments[3]);
        tissue.lead(group);
      }));
}
