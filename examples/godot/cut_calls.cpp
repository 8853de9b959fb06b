// What a script asks of a tool that changes the body.
#include "soft_tissue.hpp"

#include <stdexcept>

/* work_as(kind): what the tool does from the next press on: 0 presses, 1 cuts, 2 aspirates,
 * 3 coagulates. */
void work_as(void *instance, const GDExtensionConstTypePtr *arguments, GDExtensionTypePtr result) {
  put(result, opened(instance, [&](Tissue &tissue) {
        const int64_t kind = *static_cast<const int64_t *>(arguments[0]);
        if (kind < 0 || kind > static_cast<int64_t>(Kind::coagulate)) {
          throw std::runtime_error("work_as: the kind is " + std::to_string(kind) +
                                   "; 0 presses, 1 cuts, 2 aspirates, 3 coagulates");
        }
        tissue.kind = static_cast<Kind>(kind);
      }));
}

/* undo() -> bool: the body before the last stroke of a tool that changes it. */
void undo(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  bool done = false;
  opened(instance, [&](Tissue &tissue) { done = tissue.undo(); });
  put(result, done);
}

/* changes() -> int: where it is another number, rest() and faces() are others. */
void changes(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<int64_t *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = tissue.changes(); });
}

/* outside() -> int: so many of faces() were on the intact body's surface, the others inside. */
void outside(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<int64_t *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = static_cast<int64_t>(tissue.outside()); });
}

/* cut_area() -> float, mm2; removed() -> float, mm3: of all strokes. */
void cut_area(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<double *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = static_cast<double>(tissue.area()); });
}

void removed(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<double *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = static_cast<double>(tissue.removed()); });
}
