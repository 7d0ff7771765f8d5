// `understory why landmark|pose`: the messages of a log on one landmark or one pose.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/io/lcm_log.hpp"
#include "common/story/json.hpp"
#include "common/story/story_book.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/guarded_log.hpp"
#include "deploy/cli/story_page.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

struct WhyOptions {
  std::string subject;
  std::string file;
  bool json = false;
};

/// The whole text as a number.
template <class Number>
std::optional<Number> whole_number(std::string_view text) {
  Number number{};
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || stop != end) return std::nullopt;
  return number;
}

/// The id as in messages, or "map:number".
model::LandmarkId landmark_id_of(const std::string& text) {
  if (const auto id = whole_number<std::int64_t>(text)) return static_cast<model::LandmarkId>(*id);
  const std::size_t colon = text.find(':');
  if (colon != std::string::npos) {
    const std::string_view parts(text);
    const auto map = whole_number<std::uint16_t>(parts.substr(0, colon));
    const auto counter = whole_number<std::uint64_t>(parts.substr(colon + 1));
    if (map && counter && *counter >> model::kLandmarkCounterBits == 0)
      return (model::LandmarkId{*map} << model::kLandmarkCounterBits) | *counter;
  }
  wrong_usage(fmt::format("landmark {}: no id; it is a whole number, or MAP:NUMBER", text));
}

/// The requested pose; `seconds` if it was given with a decimal point.
struct PoseWish {
  story::PoseQuestion question;
  std::optional<double> seconds;
};

PoseWish pose_wish_of(const std::string& text) {
  using enum story::PoseQuestion::Choice;
  if (text == "last") return {{kLast, 0}, std::nullopt};
  if (text == "worst") return {{kWorst, 0}, std::nullopt};
  if (text == "slowest") return {{kSlowest, 0}, std::nullopt};
  if (const auto utime = whole_number<std::int64_t>(text)) return {{kNearest, *utime}, {}};

  const auto seconds = whole_number<double>(text);
  const bool fits = seconds && std::isfinite(*seconds) && std::abs(*seconds) < 9e12;
  if (fits) return {{kNearest, 0}, seconds};
  wrong_usage(fmt::format(
      "pose {}: no time; it is a stamp in us, seconds with a decimal point, last, worst or slowest",
      text));
}

/// The stamp of seconds as on the page, from the log's first stamp; above 10^8 (1973) since the
/// epoch.
model::Utime stamp_of(double seconds, model::Utime start) {
  const auto microseconds = static_cast<model::Utime>(std::llround(1e6 * seconds));
  return seconds >= 1e8 ? microseconds : start + microseconds;
}

/// A log in the book, and its unreadable parts.
struct ReadLog {
  story::StoryBook book{story::Limits::of_a_log()};
  io::LogDamage damage;
};

std::unique_ptr<ReadLog> read_story(const std::string& file) {
  auto log = std::make_unique<ReadLog>();
  io::LcmLogReader reader(file);
  terminal::Progress progress("reading " + file, static_cast<double>(reader.size_bytes()));
  terminal::catch_interrupts();
  while (const auto event = reader.next()) {
    terminal::throw_if_interrupted();
    log->book.take(event->channel, event->data, event->utime);
    progress.update(static_cast<double>(reader.position_bytes()));
  }
  reader.refuse_other_files();
  log->damage = reader.damage();
  return log;
}

/// Adds remarks on gaps of the log that may affect the story.
void add_faults(story::Story& story, const ReadLog& log) {
  if (log.damage.places > 0) {
    story.facts.emplace_back(
        "the log is damaged",
        fmt::format("{} bytes in {} places were skipped: messages may be missing here",
                    log.damage.bytes, log.damage.places));
  }
  if (log.book.malformed() > 0) {
    story.facts.emplace_back("malformed messages",
                             fmt::format("{} were passed over", log.book.malformed()));
  }
}

void show(story::Answer answer, const ReadLog& log, const WhyOptions& options) {
  if (!answer.story) fail(options.file + ": " + answer.error);
  add_faults(*answer.story, log);
  if (options.json) {
    fmt::print("{}\n", result_text(story::story_json(*answer.story), 2));
  } else {
    fmt::print("{}", story_page(*answer.story, log.book.start()));
  }
}

void why_landmark(const WhyOptions& options) {
  const model::LandmarkId id = landmark_id_of(options.subject);
  const auto log = read_story(options.file);
  show(log->book.landmark(id), *log, options);
}

void why_pose(const WhyOptions& options) {
  PoseWish wish = pose_wish_of(options.subject);
  const auto log = read_story(options.file);
  if (wish.seconds) wish.question.utime = stamp_of(*wish.seconds, log->book.start());
  show(log->book.pose(wish.question), *log, options);
}

template <class Work>
void add_why(CLI::App& why, const char* name, const char* description, const char* subject,
             const char* subject_text, Work work) {
  auto options = std::make_shared<WhyOptions>();
  auto* command = why.add_subcommand(name, description);
  command->add_option(subject, options->subject, subject_text)->required();
  command->add_option("file", options->file, "An LCM log")->required();
  command->add_flag("--json", options->json, "As JSON");
  command->callback(guarded(options, work));
}

}  // namespace

void add_why_command(CLI::App& parent) {
  auto* why = parent.add_subcommand("why", "How a landmark or a pose of a log came about");
  why->require_subcommand(1);
  add_why(*why, "landmark", "Origin, observations and state of a landmark", "id",
          "Id as in MAP, or MAP:NUMBER", why_landmark);
  add_why(*why, "pose", "The messages from which a pose was made, back to the sensor", "utime",
          "Stamp in us, seconds with a decimal point, last, worst (sigma) or slowest", why_pose);
}

}  // namespace understory::cli
