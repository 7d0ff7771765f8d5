#include <limits>
#include <nlohmann/json.hpp>

#include "common/foxglove/json_text.hpp"
#include "tests/catch.hpp"

namespace understory::foxglove {
namespace {

std::string base64_of(std::string_view bytes) {
  JsonText out;
  out.base64(bytes);
  return out.take();
}

TEST_CASE("values, names and commas") {
  JsonText out;
  out.begin_object();
  out.field("number", 0.1);
  out.field("whole", 5.0);
  out.field("large", 1e300);
  out.field("count", std::numeric_limits<std::uint64_t>::max());
  out.field("negative", std::numeric_limits<std::int64_t>::min());
  out.field("flag", true);
  out.field("text", "a\"b\\c\n\x01");
  out.key("list");
  out.begin_array();
  out.begin_array();
  out.end_array();
  out.begin_object();
  out.end_object();
  out.raw("[1]");
  out.value(2);
  out.end_array();
  out.field("none", std::numeric_limits<double>::infinity());
  out.end_object();

  const auto value = nlohmann::json::parse(out.take());
  REQUIRE(value["number"] == 0.1);
  REQUIRE(value["whole"] == 5);
  REQUIRE(value["large"] == 1e300);
  REQUIRE(value["count"] == std::numeric_limits<std::uint64_t>::max());
  REQUIRE(value["negative"] == std::numeric_limits<std::int64_t>::min());
  REQUIRE(value["flag"] == true);
  REQUIRE(value["text"] == "a\"b\\c\n\x01");
  REQUIRE(value["list"].dump() == "[[],{},[1],2]");
  REQUIRE(value["none"].is_null());
}

TEST_CASE("base64 as RFC 4648 has it") {
  REQUIRE(base64_of("") == "\"\"");
  REQUIRE(base64_of("f") == "\"Zg==\"");
  REQUIRE(base64_of("fo") == "\"Zm8=\"");
  REQUIRE(base64_of("foo") == "\"Zm9v\"");
  REQUIRE(base64_of("foobar") == "\"Zm9vYmFy\"");
  REQUIRE(base64_of("\xff\xfe\xfd") == "\"//79\"");
}

TEST_CASE("numbers for a display are short") {
  JsonText out;
  out.value(rounded(123.45678912));
  REQUIRE(out.take() == "123.4568");
  REQUIRE(rounded(1e308) == 1e308);
}

}  // namespace
}  // namespace understory::foxglove
