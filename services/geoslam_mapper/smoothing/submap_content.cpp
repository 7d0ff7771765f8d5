#include "services/geoslam_mapper/smoothing/submap_content.hpp"

#include <optional>
#include <stdexcept>

#include "common/state/archive.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

constexpr const char* kSubmapState = "geoslam_mapper.smoothing.submap";
constexpr state::Format kSubmapFormat{kSubmapState, 4};
/// Without the motions that represent the landmarks.
constexpr state::Format kSubmapFormat3{kSubmapState, 3};
/// Also without motions.
constexpr state::Format kSubmapFormat2{kSubmapState, 2};

/// A motion in version 3.
struct Motion3 {
  FrozenMotion motion;
  std::optional<std::uint32_t> away_tie;  ///< None in submaps.

  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    FrozenMotion& motion = s.motion;
    a(motion.a, motion.b, motion.a_T_b, motion.information, s.away_tie, motion.closure);
  }
};

/// Like load(), for bytes that may be of another version.
template <typename... Values>
bool loads(const std::string& payload, const state::Format& format, Values&... values) {
  try {
    state::load(payload, format, values...);
    return true;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

}  // namespace

std::string submap_payload(const SubmapContent& content) {
  return state::save(kSubmapFormat, content.node, content.landmarks, content.observed,
                     content.bases, content.motions, content.ties);
}

SubmapContent submap_content(const std::string& payload) {
  SubmapContent now;
  if (loads(payload, kSubmapFormat, now.node, now.landmarks, now.observed, now.bases, now.motions,
            now.ties))
    return now;

  SubmapContent before;
  std::vector<Motion3> motions;
  if (loads(payload, kSubmapFormat3, before.node, before.landmarks, before.observed, before.bases,
            motions)) {
    for (const Motion3& one : motions) before.motions.push_back(one.motion);
    return before;
  }

  SubmapContent first;
  state::load(payload, kSubmapFormat2, first.node, first.landmarks, first.observed, first.bases);
  return first;
}

}  // namespace understory::geoslam_mapper::smoothing
