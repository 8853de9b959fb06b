// What a script asks of a tool that changes the body.
#include "soft_tissue.hpp"

#include <stdexcept>

/// What the tool does from the next press on: 0 presses, 1 cuts, 2 aspirates, 3 coagulates.
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

/// Tissue that the tool stretches to so many times its length tears, where the tool presses or
/// holds; 0: none does. A press that tore something is a stroke that `undo` takes back.
void tear_at(void *instance, const GDExtensionConstTypePtr *arguments, GDExtensionTypePtr result) {
  put(result, opened(instance, [&](Tissue &tissue) {
        const double stretch = *static_cast<const double *>(arguments[0]);
        if (stretch != 0 && !(stretch > 1)) {
          throw std::runtime_error("tear_at: the stretch is " + std::to_string(stretch) +
                                   "; above 1, or 0 for none");
        }
        tissue.tear_at(static_cast<float>(stretch));
      }));
}

/// The body before the last stroke of a tool that changes it; false where there is none.
void undo(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  bool done = false;
  opened(instance, [&](Tissue &tissue) { done = tissue.undo(); });
  put(result, done);
}

/// Where it is another number than before, `rest()` and `faces()` are others.
void changes(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<int64_t *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = tissue.changes(); });
}

/// So many of `faces()`, the first ones, were on the intact body's surface; the others are inside.
void outside(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<int64_t *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = static_cast<int64_t>(tissue.outside()); });
}

/// New surface by all strokes, mm².
void cut_area(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<double *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = static_cast<double>(tissue.area()); });
}

/// What the body has lost by all strokes, mm³.
void removed(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<double *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = static_cast<double>(tissue.removed()); });
}
