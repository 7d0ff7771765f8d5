// What other processes send, on the way to a terminal and into JSON.
#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "common/terminal/printable.hpp"
#include "deploy/cli/status_table.hpp"
#include "deploy/cli/text_file.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::cli;
using terminal::printable;

namespace {

/// Clears the screen, sets the title, is no UTF-8.
const std::string kHostile = "\x1B[2J\x1B]0;x\x07 \xFF\xC3(\x7F\xC2\x9B";

health_t hostile_health() {
  health_t health{};
  health.process = "mapper" + kHostile;
  health.version = kHostile;
  health.last_error = kHostile;
  health.channels.resize(1);
  health.channels[0].channel = "CHANNEL" + kHostile;
  health.num_channels = 1;
  health.reasons.resize(1);
  health.reasons[0].channel = kHostile;
  health.reasons[0].reason = kHostile;
  health.num_reasons = 1;
  return health;
}

bool steers_a_terminal(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](char c) {
    const auto byte = static_cast<std::uint8_t>(c);
    return (byte < 0x20 && c != '\n') || byte >= 0x7F;
  });
}

}  // namespace

TEST_CASE("text of others is shown without what steers a terminal", "[cli]") {
  CHECK(printable("plain text, 3.5 %") == "plain text, 3.5 %");
  CHECK(printable("Grüße, 森, 🌲") == "Grüße, 森, 🌲");
  CHECK(printable("a\x1B[2Jb\n\t") == "a\\x1b[2Jb\\x0a\\x09");
  CHECK(printable("\x7F\xC2\x9B") == "\\x7f\\xc2\\x9b");                    // DEL, CSI of C1
  CHECK(printable("\xFF\xC3(") == "\\xff\\xc3(");                           // damaged
  CHECK(printable("\xC0\x9B\xE0\x80\x9B") == "\\xc0\\x9b\\xe0\\x80\\x9b");  // overlong ESC
  CHECK(printable("\xED\xA0\x80\xF4\x90\x80\x80").find("\\xed") == 0);      // surrogate, too large
  CHECK(printable("\xE2\x80\xAE") == "\\xe2\\x80\\xae");                    // writes backwards
  CHECK(printable(std::string_view("\0\xE2\x80", 3)) == "\\x00\\xe2\\x80");
  CHECK(terminal::printable_lines("a\nb\r") == "a\nb\\x0d");
}

TEST_CASE("hostile HEALTH reaches the terminal escaped, and JSON whole", "[cli]") {
  StatusTable table;
  const auto now = StatusTable::Clock::now();
  table.add(hostile_health(), now);
  const std::string text = table.text(now);
  CAPTURE(text);
  CHECK_FALSE(steers_a_terminal(text));
  CHECK(text.find("mapper\\x1b[2J") != std::string::npos);

  const std::string json = dumped(table.json(now), 2);
  CHECK_FALSE(steers_a_terminal(json));
  const auto parsed = nlohmann::json::parse(json);
  CHECK(parsed["processes"][0]["last_error"].get<std::string>().starts_with("\x1B[2J"));
  CHECK(parsed["processes"][0]["channels"].size() == 1);
}

TEST_CASE("status after a drive has ended: silent, not waiting", "[cli]") {
  StatusTable table;
  const auto now = StatusTable::Clock::now();
  const viewer::Verdict none_heard;
  health_t mapper{};
  mapper.process = "geoslam_mapper";
  mapper.channels.resize(2);
  mapper.channels[0].channel = "SLAM_POSE";
  mapper.channels[0].output = 1;
  mapper.channels[1].channel = "KEYFRAME";
  mapper.channels[1].messages = 7;
  table.add(mapper, now);
  health_t page{};
  page.process = "viewer";
  page.channels.resize(1);
  page.channels[0].channel = "SLAM_POSE";
  page.channels[0].messages = 5;
  table.add(page, now);
  CHECK(pose_verdict(none_heard, table).state == viewer::Verdict::State::kWaiting);

  mapper.channels[0].messages = 1234;
  table.add(mapper, now);
  const viewer::Verdict ended = pose_verdict(none_heard, table);
  CHECK(ended.state == viewer::Verdict::State::kSilent);
  CHECK(ended.text.find("1234") != std::string::npos);

  // What is heard says more.
  const viewer::Verdict heard{viewer::Verdict::State::kOk, "localised", 1};
  CHECK(pose_verdict(heard, table).text == "localised");
}
