#include "deploy/cli/loop_end.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "deploy/cli/failure.hpp"

namespace understory::cli {

model::LoopEnd loop_end_of(const std::string& option, const std::string& text) {
  const auto colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  std::uint64_t number = 0;
  const char* const begin = text.data() + std::min(text.size(), colon + 1);
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(begin, end, number);
  const bool is_number =
      colon != std::string::npos && begin != end && read.ec == std::errc{} && read.ptr == end;
  if (!is_number || (kind != "keyframe" && kind != "submap") || (kind == "submap" && number == 0))
    wrong_usage(fmt::format("{} {}: keyframe:N or submap:N (from 1) is wanted", option, text));

  model::LoopEnd result;
  (kind == "submap" ? result.submap : result.keyframe) = number;
  return result;
}

std::uint64_t manual_closure_id(const std::string& said) {
  return 1 + model::fnv1a(said) % (kManualClosures - 1);
}

}  // namespace understory::cli
