// The ends of a loop closure, as a person names them.
#pragma once

#include <string>

#include "common/model/submap.hpp"

namespace understory::cli {

/// `keyframe:N` or `submap:N` (from 1). Ends the command with how it is used where `text` is
/// neither; `option` is what it was said by.
model::LoopEnd loop_end_of(const std::string& option, const std::string& text);

/// Numbers of closures that are made here are below; those of loop_closer begin there.
inline constexpr std::uint64_t kManualClosures = std::uint64_t{1} << 40;
/// The number of a closure that is said so: the same closure has the same number.
std::uint64_t manual_closure_id(const std::string& said);

}  // namespace understory::cli
