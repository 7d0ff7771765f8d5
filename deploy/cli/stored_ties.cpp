#include "deploy/cli/stored_ties.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "services/geoslam_mapper/smoothing/submap_content.hpp"

namespace understory::cli {
namespace {

namespace smoothing = geoslam_mapper::smoothing;
using map_closure::Ties;

smoothing::SubmapContent content_of(const model::Submap& submap) {
  try {
    return smoothing::submap_content(submap.payload);
  } catch (const std::invalid_argument& error) {
    throw map_closure::ClosureError(
        fmt::format("submap {} of map {}: {}", submap.id, submap.map_id, error.what()));
  }
}

void add_content(const smoothing::SubmapContent& content, Ties& ties) {
  for (const smoothing::FrozenMotion& one : content.motions) {
    if (one.information.allFinite())
      ties.motions.push_back({one.a, one.b, one.a_T_b, one.information, one.closure});
  }
  for (const auto& observed : content.observed) {
    std::vector<map_closure::View> views;
    for (const smoothing::DormantObservation& one : observed) {
      if (one.position_m.allFinite() && one.information.allFinite())
        views.push_back({one.node, one.position_m, one.information});
    }
    if (views.size() > 1) ties.landmarks.push_back(std::move(views));
  }
}

}  // namespace

Ties stored_ties(std::span<const model::Submap> submaps) {
  Ties ties;
  for (const model::Submap& one : submaps) {
    const smoothing::SubmapContent content = content_of(one);
    ties.submap_of[content.node] = one.id;
    add_content(content, ties);
  }
  return ties;
}

}  // namespace understory::cli
