#include "script.hpp"

#include <algorithm>

Mouse scripted(const Hit &site, bool operates, long frame) {
  const auto over = [&](float x, float y) {
    const Frame f = frame_around(site.normal, {0, 0, 1});
    return Ray{site.point + f.x * x + f.y * y + site.normal * 100, -site.normal};
  };
  if (!operates) {
    return {over(0, 0), frame >= 15, Kind::press};
  }
  const float t = static_cast<float>(frame);
  if (frame < 90) {
    const float way = std::clamp((t - 15) / 60, 0.0F, 1.0F);
    return {over(0, 24 * way - 12), frame >= 15 && frame < 80, Kind::blade};
  }
  if (frame < 150) {
    const float way = std::clamp((t - 100) / 40, 0.0F, 1.0F);
    return {over(10, 8 * way - 4), frame >= 100 && frame < 145, Kind::aspirate};
  }
  if (frame < 165) {
    return {over(-12, 0), frame >= 155 && frame < 162, Kind::coagulate};
  }
  return {over(-6, 0), frame >= 170, Kind::press};
}

Mouse drawn_off(const Hit &site, long frame) {
  return {{site.point + site.normal * 100, -site.normal}, frame >= 60, Kind::press, true};
}
