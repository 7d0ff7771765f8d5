#include "common/map_file/digest.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <bit>
#include <iterator>
#include <new>

namespace understory::map_file {
namespace {

/// Little endian on every computer.
std::array<std::uint8_t, 8> eight_bytes(std::uint64_t value) {
  std::array<std::uint8_t, 8> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::uint8_t>(value >> (8 * i));
  return bytes;
}

void require(int result) {
  if (result != 1) throw std::bad_alloc();
}

}  // namespace

void DigestCloser::operator()(evp_md_ctx_st* context) const { EVP_MD_CTX_free(context); }

Digest::Digest() : context_(EVP_MD_CTX_new()) {
  if (!context_) throw std::bad_alloc();
  require(EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr));
}

void Digest::add_tagged(char tag, const void* bytes, std::size_t size) {
  const auto length = eight_bytes(size);
  require(EVP_DigestUpdate(context_.get(), &tag, 1));
  require(EVP_DigestUpdate(context_.get(), length.data(), length.size()));
  require(EVP_DigestUpdate(context_.get(), bytes, size));
}

void Digest::add(std::int64_t value) {
  const auto bytes = eight_bytes(static_cast<std::uint64_t>(value));
  add_tagged('i', bytes.data(), bytes.size());
}

void Digest::add(double value) {
  const auto bytes = eight_bytes(std::bit_cast<std::uint64_t>(value));
  add_tagged('r', bytes.data(), bytes.size());
}

void Digest::add(std::string_view value) { add_tagged('t', value.data(), value.size()); }

void Digest::add(std::span<const std::uint8_t> value) {
  add_tagged('b', value.data(), value.size());
}

void Digest::add_null() { add_tagged('n', nullptr, 0); }

std::string Digest::take() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> bytes{};
  unsigned int size = 0;
  require(EVP_DigestFinal_ex(context_.get(), bytes.data(), &size));
  std::string digits;
  for (unsigned int i = 0; i < size; ++i)
    fmt::format_to(std::back_inserter(digits), "{:02x}", bytes[i]);
  return digits;
}

}  // namespace understory::map_file
