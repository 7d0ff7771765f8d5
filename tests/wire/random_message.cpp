#include "tests/wire/random_message.hpp"

#include <array>
#include <bit>

namespace understory::test {
namespace {

class Writer {
 public:
  Writer(std::mt19937_64& random, std::vector<test::RealPlace>* reals,
         std::vector<std::size_t>* lengths, std::vector<std::size_t>* booleans)
      : random_(random), reals_(reals), lengths_(lengths), booleans_(booleans) {}

  void integer(std::uint64_t value, std::size_t size) {
    for (std::size_t i = size; i-- > 0;) {
      bytes_.push_back(static_cast<std::uint8_t>(value >> (8U * i)));
    }
  }

  void write(const wire::Layout& layout) {
    std::array<std::size_t, wire::kMostCounts> counts{};
    for (const wire::Field& field : layout.fields) {
      std::size_t elements = field.fixed;
      if (field.counted_by >= 0) elements *= counts[static_cast<std::size_t>(field.counted_by)];
      if (field.counts >= 0) {
        const std::size_t count = random_() % 4;
        counts[static_cast<std::size_t>(field.counts)] = count;
        if (lengths_ != nullptr) lengths_->push_back(bytes_.size());
        integer(count, 4);
        continue;
      }
      for (std::size_t i = 0; i < elements; ++i) element(field);
    }
  }

  wire::Bytes take() { return std::move(bytes_); }

 private:
  void element(const wire::Field& field) {
    std::normal_distribution<double> normal(0.0, 1.0);
    switch (field.kind) {
      case wire::FieldKind::kStruct:
        return write(*field.part);
      case wire::FieldKind::kString:
        return string();
      case wire::FieldKind::kDouble:
        if (reals_ != nullptr) reals_->push_back({bytes_.size(), field.kind});
        return integer(std::bit_cast<std::uint64_t>(normal(random_)), 8);

      case wire::FieldKind::kFloat:
        if (reals_ != nullptr) reals_->push_back({bytes_.size(), field.kind});
        return integer(std::bit_cast<std::uint32_t>(static_cast<float>(normal(random_))), 4);
      case wire::FieldKind::kInt64:
        return integer(random_() % 1000, 8);
      case wire::FieldKind::kInt32:
        return integer(random_() % 1000, 4);

      case wire::FieldKind::kInt16:
        return integer(random_() % 1000, 2);
      case wire::FieldKind::kBoolean:
        if (booleans_ != nullptr) booleans_->push_back(bytes_.size());
        return integer(random_() % 2, 1);
      default:
        return integer(random_() % 2, 1);
    }
  }

  void string() {
    const std::size_t letters = random_() % 6;
    if (lengths_ != nullptr) lengths_->push_back(bytes_.size());
    integer(letters + 1, 4);
    for (std::size_t i = 0; i < letters; ++i) {
      bytes_.push_back(static_cast<std::uint8_t>('a' + random_() % 26));
    }
    bytes_.push_back(0);
  }

  std::mt19937_64& random_;
  std::vector<test::RealPlace>* reals_;
  std::vector<std::size_t>* lengths_;
  std::vector<std::size_t>* booleans_;
  wire::Bytes bytes_;
};

}  // namespace

wire::Bytes random_message(const wire::WireType& type, std::mt19937_64& random,
                           std::vector<test::RealPlace>* reals, std::vector<std::size_t>* lengths,
                           std::vector<std::size_t>* booleans) {
  Writer writer(random, reals, lengths, booleans);
  writer.integer(static_cast<std::uint64_t>(type.fingerprint()), 8);
  writer.write(*type.layout);
  return writer.take();
}

void put(wire::Bytes& bytes, std::size_t offset, std::uint64_t value, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) {
    bytes.at(offset + i) = static_cast<std::uint8_t>(value >> (8U * (size - 1 - i)));
  }
}

}  // namespace understory::test
