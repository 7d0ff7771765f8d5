#include "deploy/cli/story_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "common/terminal/printable.hpp"

namespace understory::cli {
namespace {

double seconds_since(model::Utime start, model::Utime utime) {
  return 1e-6 * (static_cast<double>(utime) - static_cast<double>(start));
}

void append_facts(std::string& page, const story::Story& story) {
  std::size_t width = 0;
  for (const auto& [name, value] : story.facts) width = std::max(width, name.size());
  for (const auto& [name, value] : story.facts) {
    fmt::format_to(std::back_inserter(page), "{:<{}}  {}\n", name, width,
                   terminal::printable(value));
  }
}

void append_events(std::string& page, const story::Story& story, model::Utime start) {
  constexpr std::size_t kShown = 100;
  if (story.events.empty()) return;
  fmt::format_to(std::back_inserter(page), "\n{:>12}  {:<20}  {}\n", "time [s]", "utime",
                 "what happened");
  const std::size_t count = story.events.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (count > 2 * kShown && i == kShown) {
      fmt::format_to(std::back_inserter(page), "{:>12}  {} more (--json has all)\n", "...",
                     count - 2 * kShown);
      i = count - kShown;
    }
    const story::StoryEvent& one = story.events[i];
    fmt::format_to(std::back_inserter(page), "{:>12.3f}  {:<20}  {}\n",
                   seconds_since(start, one.utime), one.utime, terminal::printable(one.text));
  }
}

/// Appends the least and the greatest value, and a few values of the course.
void append_series(std::string& page, const story::StorySeries& series, model::Utime start) {
  constexpr std::size_t kShown = 10;
  if (series.v.empty()) return;
  const auto [least, most] = std::ranges::minmax(series.v);
  const std::string unit = series.unit.empty() ? "" : " " + series.unit;
  fmt::format_to(std::back_inserter(page), "\n{}: {} values, {:.4f} to {:.4f}{}\n", series.name,
                 series.v.size(), least, most, unit);

  const std::size_t count = std::min(series.v.size(), kShown);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = count == 1 ? 0 : k * (series.v.size() - 1) / (count - 1);
    fmt::format_to(std::back_inserter(page), "{:>12.3f}  {:.4f}\n",
                   seconds_since(start, series.t[i]), series.v[i]);
  }
}

void append_steps(std::string& page, const story::Story& story) {
  if (story.steps.empty()) return;
  fmt::format_to(std::back_inserter(page), "\n{:<23}  {:>9}  {}\n", "from the sensor on", "ms",
                 "message");
  for (const story::StoryStep& one : story.steps) {
    fmt::format_to(std::back_inserter(page), "{:<23}  {:>9}  {}\n", one.name,
                   one.ms ? fmt::format("{:.1f}", *one.ms) : "", terminal::printable(one.text));
  }
}

}  // namespace

std::string story_page(const story::Story& story, model::Utime start) {
  std::string page = terminal::printable(story.title) + "\n\n";
  append_facts(page, story);
  append_events(page, story, start);
  for (const story::StorySeries& one : story.series) append_series(page, one, start);
  append_steps(page, story);
  return page;
}

}  // namespace understory::cli
