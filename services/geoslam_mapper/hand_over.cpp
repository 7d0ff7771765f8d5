#include "services/geoslam_mapper/hand_over.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace understory::geoslam_mapper {
namespace {

/// Message time between attempts [us].
constexpr model::Utime kAgain_us = 1000000;

/// Message time between comparisons of the submaps' poses [us].
constexpr model::Utime kLook_us = 10000000;
/// Least move of a submap that is sent [m], of its node and of points at kLever_m from it.
constexpr double kMove_m = 0.05;
constexpr double kLever_m = 40.0;

bool has_moved(const model::SubmapPose& a, const model::SubmapPose& b, double by_m) {
  const geometry::SE2 move = a.map_T_submap.inverse() * b.map_T_submap;
  return a.id != b.id || move.translation().norm() + kLever_m * std::abs(move.theta()) > by_m;
}

bool is_due(model::Utime last, model::Utime now) { return last < 0 || now - last >= kAgain_us; }

}  // namespace

void HandOver::confirm(const model::SubmapStored& stored) {
  std::erase_if(waiting_, [&](const Waiting& one) {
    return one.submap.map_id == stored.map_id && one.submap.id == stored.id &&
           one.submap.content_hash == stored.content_hash;
  });
}

std::vector<model::Submap> HandOver::due(model::Utime now) {
  std::vector<model::Submap> result;
  for (Waiting& one : waiting_) {
    if (!is_due(one.sent, now)) continue;
    one.sent = now;
    result.push_back(one.submap);
  }
  return result;
}

std::optional<model::Submap> HandOver::take(std::uint32_t map_id, model::SubmapId id) {
  const auto found = std::ranges::find_if(waiting_, [&](const Waiting& one) {
    return one.submap.map_id == map_id && one.submap.id == id;
  });
  if (found == waiting_.end()) return std::nullopt;
  model::Submap submap = std::move(found->submap);
  waiting_.erase(found);
  return submap;
}

std::vector<model::SubmapId> HandOver::to_ask(std::span<const model::SubmapId> wanted,
                                              model::Utime now) {
  std::erase_if(asked_, [&](const auto& one) {
    return std::ranges::find(wanted, one.first) == wanted.end();
  });
  std::vector<model::SubmapId> result;
  for (const model::SubmapId id : wanted) {
    const auto [entry, is_new] = asked_.try_emplace(id, now);
    if (!is_new && !is_due(entry->second, now)) continue;
    entry->second = now;
    result.push_back(id);
  }
  return result;
}

bool CorrectionWatch::is_due(model::Utime now) const { return now - looked_ >= kLook_us; }

std::optional<model::MapCorrection> CorrectionWatch::next(model::Utime now, std::uint32_t map_id,
                                                          std::vector<model::SubmapPose> poses,
                                                          bool is_last) {
  looked_ = now;
  const double by_m = is_last ? 0.0 : kMove_m;
  const bool is_same =
      map_id == map_id_ && std::ranges::equal(sent_, poses, [&](const auto& a, const auto& b) {
        return !has_moved(a, b, by_m);
      });
  if (poses.empty() || is_same) return std::nullopt;

  map_id_ = map_id;
  sent_ = poses;
  model::MapCorrection correction;
  correction.utime = now;
  correction.map_id = map_id;
  correction.version = ++version_;
  correction.submaps = std::move(poses);
  return correction;
}

}  // namespace understory::geoslam_mapper
