#include "services/landmark_extractor/trunks/trunk_columns.hpp"

#include <algorithm>
#include <cmath>

namespace understory::landmark_extractor::trunks {
namespace {

constexpr float kCell_m = 0.5F;
constexpr int kMergeRounds = 3;
/// More points than any run has.
constexpr std::uint32_t kMostPoints = 0xffffffffU;

Eigen::Vector2f mean_centre(const std::vector<rings::Run>& runs,
                            const std::vector<std::uint32_t>& at) {
  Eigen::Vector2f sum = Eigen::Vector2f::Zero();
  float weight = 0.0F;
  for (const std::uint32_t i : at) {
    const auto w = static_cast<float>(runs[i].size());
    sum += w * Eigen::Vector2f(runs[i].x_m, runs[i].y_m);
    weight += w;
  }
  return sum / weight;
}

bool may_be_a_slice(const rings::Run& run, const SweepTrunkParameters& parameters) {
  return run.stands_alone() && run.width_m < 2.2 * parameters.max_radius_m;
}

}  // namespace

std::size_t ColumnFinder::cell(float coordinate, float corner) const {
  return static_cast<std::size_t>(
      std::clamp((coordinate - corner) / kCell_m, 0.0F, static_cast<float>(side_ - 1)));
}

void ColumnFinder::fill_grid(const std::vector<rings::Run>& runs,
                             const SweepTrunkParameters& parameters) {
  heads_.assign(side_ * side_, -1);
  next_.assign(runs.size(), -1);
  order_.clear();
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!may_be_a_slice(runs[i], parameters)) continue;
    order_.push_back((std::uint64_t{kMostPoints} - runs[i].size()) << 32U | i);
    std::int32_t& head =
        heads_[cell(runs[i].y_m, corner_y_) * side_ + cell(runs[i].x_m, corner_x_)];
    next_[i] = head;
    head = static_cast<std::int32_t>(i);
  }
  std::sort(order_.begin(), order_.end());
}

template <class Visit>
void ColumnFinder::visit_near(const std::vector<rings::Run>& runs, const Eigen::Vector2f& axis,
                              float radius, Visit visit) const {
  const std::size_t last_i = cell(axis.x() + radius, corner_x_);
  const std::size_t last_j = cell(axis.y() + radius, corner_y_);
  for (std::size_t j = cell(axis.y() - radius, corner_y_); j <= last_j; ++j) {
    for (std::size_t i = cell(axis.x() - radius, corner_x_); i <= last_i; ++i) {
      for (std::int32_t k = heads_[j * side_ + i]; k >= 0; k = next_[static_cast<std::size_t>(k)]) {
        const auto index = static_cast<std::uint32_t>(k);
        const Eigen::Vector2f offset = Eigen::Vector2f(runs[index].x_m, runs[index].y_m) - axis;
        if (offset.squaredNorm() <= radius * radius) visit(index);
      }
    }
  }
}

void ColumnFinder::gather(const std::vector<rings::Run>& runs, const Eigen::Vector2f& axis,
                          float radius) {
  gathered_.clear();
  visit_near(runs, axis, radius, [&](std::uint32_t index) {
    if (taken_[index] == 0) gathered_.push_back(index);
  });
}

void ColumnFinder::runs_near(const std::vector<rings::Run>& runs, const Eigen::Vector2f& centre_m,
                             float radius_m, float highest_m,
                             std::vector<std::uint32_t>& near) const {
  near.clear();
  visit_near(runs, centre_m, radius_m, [&](std::uint32_t index) {
    if (runs[index].height_m <= highest_m) near.push_back(index);
  });
}

const std::vector<Column>& ColumnFinder::find(const std::vector<rings::Run>& runs,
                                              const SweepTrunkParameters& parameters,
                                              const Eigen::Vector2f& centre_m, float reach_m) {
  corner_x_ = centre_m.x() - reach_m;
  corner_y_ = centre_m.y() - reach_m;
  side_ = static_cast<std::size_t>(std::ceil(2.0F * reach_m / kCell_m)) + 1;
  taken_.assign(runs.size(), 0);
  columns_.clear();
  fill_grid(runs, parameters);

  // Each run is in at most one column, so spans of members_ stay valid.
  members_.clear();
  members_.reserve(order_.size());
  for (const std::uint64_t entry : order_) {
    const auto seed = static_cast<std::uint32_t>(entry);
    if (taken_[seed] != 0) continue;

    // Runs around the seed, then around their mean.
    Eigen::Vector2f axis(runs[seed].x_m, runs[seed].y_m);
    // Half hidden runs of a thick trunk are farther apart than whole runs of a thin one.
    const float radius =
        static_cast<float>(parameters.gather_radius_m) + 0.25F * runs[seed].width_m;
    for (int round = 0; round < kMergeRounds; ++round) {
      gather(runs, axis, radius);
      if (gathered_.empty()) break;
      axis = mean_centre(runs, gathered_);
    }
    taken_[seed] = 1;
    if (gathered_.empty()) continue;

    Column column;
    column.centre_m = axis.cast<double>();
    for (const std::uint32_t i : gathered_) {
      taken_[i] = 1;
      column.points += runs[i].size();
    }
    std::sort(gathered_.begin(), gathered_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return runs[a].z_m < runs[b].z_m || (runs[a].z_m == runs[b].z_m && a < b);
    });

    column.runs = {members_.data() + members_.size(), gathered_.size()};
    members_.insert(members_.end(), gathered_.begin(), gathered_.end());
    columns_.push_back(column);
  }
  return columns_;
}

}  // namespace understory::landmark_extractor::trunks
