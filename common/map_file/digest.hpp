// SHA-256, from OpenSSL's libcrypto.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

struct evp_md_ctx_st;

namespace understory::map_file {

/// Deleter of libcrypto's contexts.
struct DigestCloser {
  /// Ends a digest.
  void operator()(evp_md_ctx_st* context) const;
};

/// One digest over values in order, as 64 hexadecimal digits. Type and length of each value are
/// included, so that different sequences of values never have equal bytes.
class Digest {
 public:
  /// An empty digest. Throws std::bad_alloc.
  Digest();

  /// Adds an integer.
  void add(std::int64_t value);
  /// Adds a number, bit by bit.
  void add(double value);
  /// Adds a text.
  void add(std::string_view value);
  /// Adds bytes.
  void add(std::span<const std::uint8_t> value);
  /// Adds a missing value.
  void add_null();
  /// The digest; nothing can be added afterwards.
  std::string take();

 private:
  void add_tagged(char tag, const void* bytes, std::size_t size);

  std::unique_ptr<evp_md_ctx_st, DigestCloser> context_;
};

}  // namespace understory::map_file
