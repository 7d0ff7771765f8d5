#include "eval/experiments/existence/forest_drive.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace understory::eval::experiments::existence {

StemGrid::StemGrid(const std::vector<CensusStem>& stems, double range_m) : range_m_(range_m) {
  for (std::uint32_t i = 0; i < stems.size(); ++i) cells_[cell_of(stems[i].place_m)].push_back(i);
}

std::vector<std::uint32_t> StemGrid::near(const Eigen::Vector2f& place_m) const {
  std::vector<std::uint32_t> found;
  const auto [column, row] = cell_of(place_m);
  for (int x = column - 1; x <= column + 1; ++x) {
    for (int y = row - 1; y <= row + 1; ++y) {
      const auto cell = cells_.find({x, y});
      if (cell == cells_.end()) continue;
      found.insert(found.end(), cell->second.begin(), cell->second.end());
    }
  }
  return found;
}

std::pair<int, int> StemGrid::cell_of(const Eigen::Vector2f& place_m) const {
  return {static_cast<int>(std::floor(place_m.x() / range_m_)),
          static_cast<int>(std::floor(place_m.y() / range_m_))};
}

ForestDrive::ForestDrive(const std::vector<CensusStem>& stems, const StemGrid& grid,
                         const ForestSetting& setting, bool is_later, std::mt19937_64& random)
    : stems_(stems),
      grid_(grid),
      setting_(setting),
      is_later_(is_later),
      random_(random),
      clear_(stems.size(), 0),
      directions_(stems.size(), 0) {
  for (std::size_t i = 0; i < stems.size(); ++i)
    can_be_seen_.push_back(unit() >= setting.pass_missed);
}

void ForestDrive::find_view(const Eigen::Vector2f& place_m) {
  view_.clear();
  for (const std::uint32_t i : grid_.near(place_m)) {
    const Eigen::Vector2f way = stems_[i].place_m - place_m;
    const float distance_m = way.norm();
    if (distance_m > setting_.range_m || distance_m < 0.7F) continue;
    view_.push_back({i, distance_m, std::atan2(way.y(), way.x()),
                     std::asin(std::min(1.0F, stems_[i].radius_m / distance_m))});
  }
  std::sort(view_.begin(), view_.end(),
            [](const StemInView& a, const StemInView& b) { return a.distance_m < b.distance_m; });
}

/// Whether one that stands nearer hides the centre of this one.
bool ForestDrive::is_hidden(std::size_t index) const {
  for (std::size_t k = 0; k < index; ++k) {
    const float apart =
        std::remainder(view_[k].bearing - view_[index].bearing, 2.0F * std::numbers::pi_v<float>);
    if (std::abs(apart) < view_[k].half_width && stands(view_[k].stem)) return true;
  }
  return false;
}

void ForestDrive::scan(const Eigen::Vector2f& place_m) {
  find_view(place_m);
  for (std::size_t k = 0; k < view_.size(); ++k) {
    const StemInView& one = view_[k];
    LookEvent event;
    event.point = one.stem;
    event.look.from_point_m << place_m - stems_[one.stem].place_m, 0.5F;
    event.is_clear = !is_hidden(k);
    event.recall = setting_.recall_near +
                   one.distance_m / setting_.range_m * (setting_.recall_far - setting_.recall_near);
    const bool is_false = unit() < setting_.false_rate;
    const bool is_detected = unit() < event.recall;
    event.is_seen =
        is_false || (stands(one.stem) && can_be_seen_[one.stem] && event.is_clear && is_detected);
    if (!event.is_clear) event.look.ray = understory::existence::Ray::kBlocked;
    drive_.looks.push_back(event);
    if (!event.is_clear) continue;

    ++clear_[one.stem];
    const float turn = one.bearing / std::numbers::pi_v<float> + 1.0F;
    directions_[one.stem] |= 1U << (static_cast<unsigned>(turn * 4.0F) % 8U);
  }
}

DriveLooks ForestDrive::finish(double time_s) {
  DriveLooks drive = std::move(drive_);
  drive_ = {};
  drive.time_s = time_s;
  for (std::size_t i = 0; i < stems_.size(); ++i)
    drive.truth.push_back({stands(i), clear_[i] >= 10 && std::popcount(directions_[i]) >= 3,
                           stands(i) && clear_[i] == 0});
  return drive;
}

}  // namespace understory::eval::experiments::existence
