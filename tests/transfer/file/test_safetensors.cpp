#include "transfer/file/safetensors.h"

#include <gtest/gtest.h>

#include <cstring>
#include <numeric>
#include <random>

#include "tests/support/expect_error.h"
#include "tests/support/temporary_folder.h"

namespace rebounce::test_safetensors {
namespace {

using test::error_of;
using test::expect_error;

template <typename T>
TensorView view(std::string name, TensorShape shape, const std::vector<T>& values,
                TensorType type = tensor_type<T>()) {
  return {std::move(name), type, std::move(shape), std::as_bytes(std::span(values))};
}

/// A file in memory, in a buffer of exactly its size, so that a sanitizer sees a step beyond it.
SafetensorsFile parse(const std::string& bytes) {
  std::vector<std::byte> copy(bytes.size());
  if (!bytes.empty()) std::memcpy(copy.data(), bytes.data(), bytes.size());
  return {SharedArray<std::byte>(std::move(copy)), "file"};
}

std::string file_with(const std::string& header, const std::string& data) {
  const std::uint64_t length = header.size();
  std::string bytes(sizeof(length), '\0');
  std::memcpy(bytes.data(), &length, sizeof(length));
  return bytes + header + data;
}

std::string entry(const std::string& name, const std::string& dtype, const std::string& shape,
                  const std::string& offsets) {
  return "\"" + name + "\":{\"dtype\":\"" + dtype + "\",\"shape\":" + shape +
         ",\"data_offsets\":" + offsets + "}";
}

const std::vector<float> kPair{1, -2};
const std::vector<std::uint8_t> kTriple{1, 2, 3};

SafetensorsLayout golden_layout() {
  return lay_out_safetensors({view("a", {3}, kTriple), view("b", {1, 2}, kPair)}, {{"k", "v"}});
}

std::string golden_bytes() {
  std::string header =
      R"({"__metadata__":{"k":"v"},"a":{"data_offsets":[8,11],"dtype":"U8","shape":[3]},)"
      R"("b":{"data_offsets":[0,8],"dtype":"F32","shape":[1,2]}})";
  header.resize(3 * 64 - 8, ' ');
  return file_with(header, std::string("\x00\x00\x80\x3f\x00\x00\x00\xc0\x01\x02\x03", 11));
}

TEST(Safetensors, WritesTheGoldenBytes) {
  const test::TemporaryFolder folder;
  write_safetensors(folder / "file", golden_layout());
  EXPECT_EQ(test::read_bytes(folder / "file"), golden_bytes());
}

TEST(Safetensors, ReadsTheGoldenBytes) {
  const SafetensorsFile file = parse(golden_bytes());
  EXPECT_EQ(file.metadata(), (SafetensorsMetadata{{"k", "v"}}));
  EXPECT_EQ(file.tensors().size(), 2U);
  const auto pair = file.tensor<float>("b", {1, 2});
  EXPECT_EQ(std::vector(pair.begin(), pair.end()), kPair);
  const auto triple = file.tensor<std::uint8_t>("a", {kAnySize});
  EXPECT_EQ(std::vector(triple.begin(), triple.end()), kTriple);
}

TEST(Safetensors, RoundTripsEveryTypeThroughAFile) {
  const std::vector<double> f64{1.5};
  const std::vector<std::uint32_t> u32{7, 8, 9};
  const std::vector<std::uint64_t> u64{~std::uint64_t{0}, 2};
  const std::vector<std::uint16_t> u16{0x3c00, 0xc000, 1, 2};
  const std::vector<float> empty;
  const test::TemporaryFolder folder;
  write_safetensors(
      folder / "file",
      lay_out_safetensors({view("f64", {}, f64), view("u32", {3}, u32), view("u64", {2, 1}, u64),
                           view("u16", {4}, u16), view("f16", {2, 2}, u16, TensorType::kF16),
                           view("empty", {0, 3}, empty)},
                          {}));
  SharedArray<std::uint64_t> kept;
  {
    const SafetensorsFile file(folder / "file");
    EXPECT_EQ(file.tensor<double>("f64", {})[0], 1.5);
    EXPECT_EQ(file.tensor<std::uint32_t>("u32", {3})[2], 9U);
    EXPECT_EQ(file.tensor<std::uint16_t>("u16", {4})[1], 0xc000);
    EXPECT_EQ(file.tensor<std::uint16_t>("f16", {2, 2}, TensorType::kF16)[0], 0x3c00);
    EXPECT_TRUE(file.tensor<float>("empty", {0, 3}).empty());
    kept = file.tensor<std::uint64_t>("u64", {2, 1});
  }
  EXPECT_EQ(kept[0], ~std::uint64_t{0}) << "the array keeps the mapping alive";
}

TEST(Safetensors, AlignsEachTensorAsFarAsItsSizeAllows) {
  std::vector<std::vector<std::uint8_t>> contents;
  for (const std::size_t size : {3, 64, 5, 192, 8, 12, 1, 0, 128, 40}) contents.emplace_back(size);
  std::vector<TensorView> tensors;
  for (std::size_t i = 0; i < contents.size(); ++i) {
    tensors.push_back(view("t" + std::to_string(i), {contents[i].size()}, contents[i]));
  }
  const SafetensorsLayout layout = lay_out_safetensors(tensors, {{"text", "to move the data"}});
  EXPECT_EQ(layout.prefix.size() % 64, 0U);
  std::size_t offset = 0;
  for (const TensorView& tensor : layout.tensors) {
    const std::size_t size = tensor.bytes.size() | 64;
    EXPECT_EQ(offset % (size & ~(size - 1)), 0U) << tensor.name;
    offset += tensor.bytes.size();
  }
}

TEST(Safetensors, IsTheSameInAnyOrderOfTensors) {
  const auto there = lay_out_safetensors({view("a", {3}, kTriple), view("b", {2}, kPair)}, {});
  const auto back = lay_out_safetensors({view("b", {2}, kPair), view("a", {3}, kTriple)}, {});
  EXPECT_EQ(there.prefix, back.prefix);
  EXPECT_EQ(there.tensors.front().name, back.tensors.front().name);
}

TEST(Safetensors, RefusesToWriteANameTwice) {
  expect_error(
      [] {
        lay_out_safetensors({view("a", {3}, kTriple), view("a", {2}, kPair)}, {});
      },
      "tensor a");
  expect_error([] { lay_out_safetensors({view("__metadata__", {2}, kPair)}, {}); },
               "used twice or reserved");
}

TEST(Safetensors, TypedAccessNamesTheTensorItRefuses) {
  const SafetensorsFile file = parse(golden_bytes());
  expect_error([&] { file.tensor<float>("c", {2}); }, "file: tensor c is missing");
  expect_error([&] { file.tensor<float>("a", {3}); }, "tensor a is U8[3], not F32[3]");
  expect_error([&] { file.tensor<float>("b", {2}); }, "tensor b is F32[1, 2], not F32[2]");
  expect_error([&] { file.tensor<float>("b", {kAnySize, 3}); }, "not F32[any, 3]");
}

TEST(Safetensors, TypedAccessRefusesATensorThatIsNotAligned) {
  const SafetensorsFile file = parse(file_with(
      "{" + entry("a", "U8", "[1]", "[0,1]") + "," + entry("b", "F32", "[1]", "[1,5]") + "}   ",
      "12345"));
  EXPECT_EQ(file.tensor<std::uint8_t>("a", {1})[0], '1');
  expect_error([&] { file.tensor<float>("b", {1}); }, "tensor b is not aligned");
}

struct Malformed {
  const char* what;
  std::string bytes;
  const char* message;
};

std::vector<Malformed> malformed_headers() {
  const std::string good = entry("a", "U8", "[3]", "[0,3]");
  std::string beyond = file_with("{" + good + "}", "123");
  beyond[0] = 127;
  std::string huge = beyond;
  huge[7] = 127;
  const auto file = [](const std::string& header) { return file_with(header, "123"); };
  return {
      {"nothing", "", "truncated, shorter than a header"},
      {"half a length", std::string(7, '\0'), "truncated, shorter than a header"},
      {"no header", std::string(8, '\0'), "not a JSON object"},
      {"a header beyond the file", beyond, "truncated: the header exceeds the file"},
      {"a header beyond the limit", huge, "exceed 100 MB"},
      {"a header cut short", file_with("{" + good, "}123"), "not valid JSON"},
      {"an array", file("[]"), "not a JSON object"},
      {"a blank first", file(" {" + good + "}"), "not a JSON object"},
      {"two values", file("{" + good + "}{}"), "not valid JSON"},
      {"not UTF-8", file("{" + entry("\xff", "U8", "[3]", "[0,3]") + "}"), "not valid JSON"},
      {"a name twice", file("{" + good + "," + good + "}"), "appears twice"},
      {"metadata twice", file("{\"__metadata__\":{},\"__metadata__\":{}," + good + "}"), "twice"},
      {"a key twice", file(R"({"a":{"dtype":"U8","shape":[3],"shape":[3]}})"), "appears twice"},
      {"nesting", file("{\"a\":" + std::string(50'000, '[')), "nested more than 3"},
      {"metadata of another type", file("{\"__metadata__\":3," + good + "}"), "not an object"},
      {"metadata that is no text", file("{\"__metadata__\":{\"k\":1}," + good + "}"),
       "not a string"},
  };
}

std::vector<Malformed> malformed_tensors() {
  const auto one = [](const std::string& dtype, const std::string& shape,
                      const std::string& offsets) {
    return file_with("{" + entry("a", dtype, shape, offsets) + "}", "12345678");
  };
  const auto two = [](const std::string& first, const std::string& second) {
    return file_with(
        "{" + entry("a", "U8", "[4]", first) + "," + entry("b", "U8", "[4]", second) + "}",
        "12345678");
  };
  return {
      {"an unknown dtype", one("U9", "[8]", "[0,8]"), "\"a\": unknown dtype"},
      {"a dtype of another size", one("F32", "[8]", "[0,8]"), "do not agree"},
      {"a shape of another size", one("U8", "[7]", "[0,8]"), "do not agree"},
      {"a shape that overflows", one("U8", "[4294967296,4294967296,8]", "[0,8]"), "do not agree"},
      {"a shape that overflows to fit", one("F64", "[2305843009213693953]", "[0,8]"), "agree"},
      {"a negative size", one("U8", "[-8]", "[0,8]"), "not a whole number"},
      {"a fraction", one("U8", "[8.0]", "[0,8]"), "not a whole number"},
      {"a number beyond 64 bits", one("U8", "[99999999999999999999]", "[0,8]"),
       "not a whole number"},
      {"a shape that is no array", one("U8", "8", "[0,8]"), "shape is not an array"},
      {"offsets that descend", one("U8", "[8]", "[8,0]"), "not a range"},
      {"offsets beyond the file", one("U8", "[9]", "[0,9]"), "it is truncated: tensor"},
      {"three offsets", one("U8", "[8]", "[0,8,8]"), "not a range"},
      {"a missing key", file_with(R"({"a":{"dtype":"U8","shape":[0]}})", ""), "not described by"},
      {"a key too many",
       file_with(R"({"a":{"dtype":"U8","shape":[0],"data_offsets":[0,0],"x":0}})", ""),
       "not described by"},
      {"an overlap", two("[0,4]", "[3,7]"), "overlap"},
      {"the same place", two("[0,4]", "[0,4]"), "overlap"},
      {"a hole", one("U8", "[4]", "[4,8]"), "gaps"},
      {"bytes left over", one("U8", "[4]", "[0,4]"), "left over"},
      {"bytes without a tensor", file_with("{}", "1"), "left over"},
  };
}

void expect_refused(const std::vector<Malformed>& files) {
  for (const Malformed& malformed : files) {
    SCOPED_TRACE(malformed.what);
    expect_error([&] { parse(malformed.bytes); }, malformed.message);
  }
}

TEST(Safetensors, RefusesMalformedHeaders) {
  expect_refused(malformed_headers());
}

TEST(Safetensors, RefusesMalformedTensors) {
  expect_refused(malformed_tensors());
}

TEST(Safetensors, RefusesTheGoldenFileCutAnywhere) {
  const std::string golden = golden_bytes();
  for (std::size_t size = 0; size < golden.size(); ++size) {
    EXPECT_THROW(parse(golden.substr(0, size)), Error) << size;
  }
}

TEST(Safetensors, AMessageIsOneLineWhateverTheName) {
  const std::string text = error_of(
      [] { parse(file_with("{" + entry("a\\nb", "U9", "[8]", "[0,8]") + "}", "12345678")); });
  EXPECT_NE(text.find("a\\nb"), std::string::npos) << text;
}

TEST(Safetensors, ReportsAFileThatCannotBeRead) {
  const test::TemporaryFolder folder;
  expect_error([&] { SafetensorsFile(folder / "none"); }, "cannot read");
  expect_error([&] { SafetensorsFile(folder / ""); }, "not a regular file");
  test::write_bytes(folder / "empty", "");
  expect_error([&] { SafetensorsFile(folder / "empty"); }, "truncated, shorter than a header");
}

TEST(Safetensors, RefusesAFileThatMemoryCannotHold) {
  const test::TemporaryFolder folder;
  test::write_bytes(folder / "huge", std::string(16, ' '));
  std::error_code error;
  std::filesystem::resize_file(folder / "huge", std::uintmax_t{4} << 40, error);  // a hole
  if (error) GTEST_SKIP() << "no files of 4 TiB here: " << error.message();
  expect_error([&] { SafetensorsFile(folder / "huge"); }, "it has 4096 GiB, this machine");
}

/// One to four random edits: what a bad disk, a bad tool or a bad person might do.
std::string mutated(std::string bytes, std::mt19937_64& random) {
  static const std::vector<std::string> kTokens{
      "{",     "}",     "[",      "]",       "\"",
      ",",     ":",     "0",      "-1",      "18446744073709551615",
      "1e9",   "null",  "\"U8\"", "\"F64\"", "\"shape\"",
      "\"a\"", "[0,8]", "[8,11]", "\\u0000", "\xff"};
  const std::size_t edits = 1 + random() % 4;
  for (std::size_t i = 0; i < edits && !bytes.empty(); ++i) {
    const std::size_t at = random() % bytes.size();
    switch (random() % 6) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
        break;
      case 1:
        bytes[at] = static_cast<char>(random());
        break;
      case 2:
        bytes.erase(at, 1 + random() % 8);
        break;
      case 3:
        bytes.insert(at, kTokens[random() % kTokens.size()]);
        break;
      case 4:
        bytes[random() % 8 % bytes.size()] = static_cast<char>(random());
        break;
      case 5:
        bytes[at] = static_cast<char>('0' + random() % 10);
        break;
    }
  }
  return bytes;
}

TEST(Safetensors, SurvivesRandomMutations) {
  constexpr std::uint64_t kSeed = 20240607;
  constexpr int kCount = 20'000;
  RecordProperty("seed", std::to_string(kSeed));
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  const std::string golden = golden_bytes();
  int loaded = 0;
  unsigned sum = 0;
  for (int i = 0; i < kCount; ++i) {
    const std::string bytes = mutated(golden, random);
    try {
      const SafetensorsFile file = parse(bytes);
      for (const auto& [name, info] : file.tensors()) {
        if (info.type != TensorType::kU8) continue;
        const auto values = file.tensor<std::uint8_t>(name, info.shape);
        sum = std::accumulate(values.begin(), values.end(), sum);
      }
      ++loaded;
    } catch (const Error&) {
    }
  }
  // Edits of values and of blanks are harmless, most others are not: both must have happened.
  EXPECT_GT(loaded, kCount / 100) << sum;
  EXPECT_LT(loaded, kCount / 2);
}

}  // namespace
}  // namespace rebounce::test_safetensors
