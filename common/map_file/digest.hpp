// SHA-256, from OpenSSL's libcrypto.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

struct evp_md_ctx_st;

namespace understory::map_file {

/// Releases what libcrypto gave.
struct DigestCloser {
  /// Ends a digest.
  void operator()(evp_md_ctx_st* context) const;
};

/// One digest: what is added, in order, then its 64 hexadecimal digits. Values are told apart by
/// their type and length, so that no two sequences of values are the same bytes.
class Digest {
 public:
  /// Of nothing. Throws std::bad_alloc.
  Digest();

  /// A whole number.
  void add(std::int64_t value);
  /// A number, bit by bit.
  void add(double value);
  /// A text.
  void add(std::string_view value);
  /// Bytes.
  void add(std::span<const std::uint8_t> value);
  /// A value that is not there.
  void add_null();
  /// The digest; nothing can be added behind it.
  std::string take();

 private:
  void add_tagged(char tag, const void* bytes, std::size_t size);

  std::unique_ptr<evp_md_ctx_st, DigestCloser> context_;
};

}  // namespace understory::map_file
