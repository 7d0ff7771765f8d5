// A story as a page of text.
#pragma once

#include <string>

#include "common/story/story.hpp"

namespace understory::cli {

/// The page, with times in seconds since `start` beside the stamps. Long lists are shortened to the
/// first and the last 100 events.
std::string story_page(const story::Story& story, model::Utime start);

}  // namespace understory::cli
