// A gall bladder, a ball here, that hangs on the tissue by its bed: ties, which tear one by one
// when forceps draw the ball off.
#pragma once

#include <vector>

#include "tissue.hpp"

class Bladder {
public:
  static constexpr float RADIUS = 9; // mm

  // At a site of the tissue at rest. From now on each step of the tissue has the bed; the ball is
  // the first of its instruments.
  void hang(Tissue &tissue, const Hit &site);
  bool hangs() const { return !bed_.empty(); }
  // Whether the forceps are in the hand.
  void take(bool forceps) { held_ = forceps && hangs(); }
  bool held() const { return held_; }
  // For `seconds`: they draw it off and turn it, so that its bed peels, or it stays where it is.
  void move(float seconds, bool drawn);
  // Before a frame at `now`: the ball and the instruments after it, in the world. The bed goes with
  // the organ, and the ball does.
  std::vector<upt_instrument> with(const Tissue &tissue, double now,
                                   const std::vector<upt_instrument> &instruments) const;
  // After a frame: which ties have torn.
  void read(Tissue &tissue);
  // It hangs on all of its bed again.
  void reset();

  std::size_t ties() const { return bed_.size(); }
  std::size_t torn() const { return torn_; }
  float pull() const { return pull_; } // of the bed on the ball, mN
  // Triangles of position and normal, 6 floats a corner, in the world: the ball, and the whole
  // ties.
  std::vector<float> ball(const Tissue &tissue) const;
  std::vector<float> threads(const Tissue &tissue) const;

private:
  Vec3 place() const { return site_ + around_.z * (RADIUS + drawn_); }
  float angle() const;
  Vec3 turned(Vec3 way) const; // from the ball's frame, which is the mesh's at first

  Vec3 site_;
  Frame around_; // `z` leads out of the tissue
  float drawn_ = 0, pull_ = 0;
  std::size_t torn_ = 0;
  bool held_ = false;
  std::vector<upt_tie> bed_;
  std::vector<upt_tie_reading> readings_;
  std::vector<std::uint32_t> roots_; // of the ties, vertices of the surface
};
