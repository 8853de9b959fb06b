// The spatula: follows the mouse over the tissue and presses while the button is down. Where the
// bundle solves contact it drives the steps as a rigid instrument, else it says which nodes it
// touches.
#pragma once

#include "tissue.hpp"

class Spatula {
public:
  // Half sizes of the blade, mm: across, along, through.
  static constexpr Vec3 HALF = {5.0F, 8.0F, 0.7F};

  explicit Spatula(float max_depth) : max_depth_(max_depth) {}

  // The surface point under the mouse; none: the spatula stays.
  void hover(const std::optional<Hit> &hit, const Ray &ray);
  // Moves for `seconds`: down while `pressed`, back up after.
  void move(float seconds, bool pressed);
  // The blade while it is at the tissue; none: it hovers.
  std::vector<upt_instrument> instruments() const;
  // Contact nodes and displacements at the present pose, for bundles without a linear response.
  // Uses the library's rule where this build has it, else its own: nodes below the blade move down
  // to its plane and along with it.
  Contacts contacts(Tissue &tissue);

  bool visible() const { return visible_; }
  float depth() const { return depth_; }
  bool library_contacts() const { return library_contacts_; }
  Vec3 centre() const;
  const Frame &frame() const { return frame_; }

private:
  upt_instrument blade() const;
  bool library(Tissue &tissue, Contacts &out);
  void own(const Tissue &tissue, Contacts &out) const;

  Hit anchor_{};
  Frame frame_{};
  Vec3 drag_{};
  float depth_ = -4, max_depth_;
  bool visible_ = false, engaged_ = false, library_contacts_ = true;
};
