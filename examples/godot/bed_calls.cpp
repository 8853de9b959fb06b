// What a script asks of a bed: ties between the tissue and what the tool is, which tear one by one.
#include "soft_tissue.hpp"

/* hang(place [m], radius [mm], stiffness [N/m], tears_at [mN]) -> int: the tissue this near to a
 * place is tied to the tool where that is now, and goes with it. Stiffness and strength are those
 * of all ties together. How many ties there are; a tool that is released takes them along. */
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

/* torn() -> int: ties of the bed that have torn until the last step. */
void torn(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<int64_t *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = static_cast<int64_t>(tissue.torn()); });
}
