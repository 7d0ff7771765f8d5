#include "services/geoslam_mapper/smoothing/submap_content.hpp"

#include <stdexcept>

#include "common/state/archive.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

constexpr const char* kSubmapState = "geoslam_mapper.smoothing.submap";
constexpr state::Format kSubmapFormat{kSubmapState, 3};
/// Without motions.
constexpr state::Format kSubmapFormat2{kSubmapState, 2};

}  // namespace

std::string submap_payload(const SubmapContent& content) {
  return state::save(kSubmapFormat, content.node, content.landmarks, content.observed,
                     content.bases, content.motions);
}

SubmapContent submap_content(const std::string& payload) {
  SubmapContent content;
  try {
    state::load(payload, kSubmapFormat, content.node, content.landmarks, content.observed,
                content.bases, content.motions);
  } catch (const std::invalid_argument&) {
    content = {};
    state::load(payload, kSubmapFormat2, content.node, content.landmarks, content.observed,
                content.bases);
  }
  return content;
}

}  // namespace understory::geoslam_mapper::smoothing
