// The writer's bytes against those of the format's own conformance suite (foxglove/mcap,
// tests/conformance/data): the suite keeps SHA-256 and size of each expected file. Of its variants
// this writer makes those with all of its features and no padding.
#include <openssl/evp.h>

#include <array>

#include "common/mcap/writer.hpp"
#include "tests/catch.hpp"
#include "tests/mcap/mcap_reader.hpp"
#include "tests/scratch.hpp"

namespace understory::mcap {
namespace {

std::string sha256(const std::string& bytes) {
  std::array<unsigned char, 32> digest{};
  unsigned size = 0;
  ::EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, ::EVP_sha256(), nullptr);
  std::string hex;
  for (const unsigned char byte : digest) {
    hex += "0123456789abcdef"[byte >> 4U];
    hex += "0123456789abcdef"[byte & 15U];
  }
  return hex;
}

/// The suite leaves profile and library empty and does not compress.
template <class Fill>
std::string written(Fill fill) {
  const test::Scratch scratch("conformance");
  const std::string path = scratch.path() / "out.mcap";
  Writer writer(path, {"", "", 1 << 20, false});
  fill(writer);
  writer.commit();
  return test::bytes_of(path);
}

TEST_CASE("conformance: TenMessages-ch-chx-mx-rch-rsh-st-sum") {
  constexpr std::array<std::uint64_t, 10> kTimes{0, 2, 1, 3, 3, 5, 4, 7, 8, 9};
  const std::string bytes = written([&](Writer& writer) {
    const auto schema = writer.add(Schema{"Example", "c", "\x04\x05\x06"});
    const auto channel = writer.add(Channel{schema, "example", "a", {{"foo", "bar"}}});
    for (std::uint32_t i = 0; i < kTimes.size(); ++i) {
      writer.write({channel, i, kTimes[i], kTimes[i], "\x01\x02\x03"});
    }
  });
  REQUIRE(bytes.size() == 1053);
  REQUIRE(sha256(bytes) == "813c4eb55e1195e5af9482f60d9b214cd083a8805720ec1663812637d716e4d5");
}

TEST_CASE("conformance: OneSchemalessMessage-ch-chx-mx-rch-st-sum") {
  const std::string bytes = written([](Writer& writer) {
    const auto channel = writer.add(Channel{0, "example", "text", {}});
    writer.write({channel, 10, 2, 1, "\x01\x02\x03"});
  });
  REQUIRE(bytes.size() == 487);
  REQUIRE(sha256(bytes) == "e9b4aa6f672b611783230a6d642e50dcdf8620ee938226f8e86ca9f22ec64848");
}

}  // namespace
}  // namespace understory::mcap
