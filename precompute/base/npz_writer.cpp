#include "precompute/base/npz_writer.h"

#include <zip.h>

#include <array>
#include <bit>
#include <limits>
#include <memory>

#include "rebounce/error.h"
#include "transfer/file/atomic_file.h"

namespace rebounce {
namespace {

static_assert(std::endian::native == std::endian::little, "the arrays are declared little-endian");

// numpy.lib.format: the data of an .npy file begins at a multiple of this number of bytes.
constexpr std::size_t kNpyAlignment = 64;

// 1980-01-01 00:00, the earliest time of a zip: the same arrays give the same bytes at any time.
constexpr zip_uint16_t kZipTime = 0;
constexpr zip_uint16_t kZipDate = (1 << 5) | 1;

struct NumpyTypeTraits {
  const char* name;
  std::size_t size;
};

/// Indexed by NumpyType.
constexpr std::array<NumpyTypeTraits, 7> kNumpyTypes{
    {{"<f4", 4}, {"<f8", 8}, {"<u4", 4}, {"<u8", 8}, {"<i4", 4}, {"<i8", 8}, {"|S3", 3}}};

const NumpyTypeTraits& traits(NumpyType type) {
  return kNumpyTypes[static_cast<std::size_t>(type)];
}

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& reason) {
  throw Error("cannot write " + path.string() + ": " + reason);
}

/// A shape as a Python tuple: one element is followed by a comma too.
std::string shape_text(const std::vector<std::size_t>& shape) {
  std::string text = "(";
  for (const std::size_t size : shape) text += std::to_string(size) + ", ";
  if (shape.size() > 1) text.resize(text.size() - 2);
  if (shape.size() == 1) text.resize(text.size() - 1);
  return text + ")";
}

/// The bytes before the data in an .npy file: version 1.0, or 2.0 where 16 bits cannot hold the
/// length of the header.
std::string npy_header(const NumpyArray& array) {
  std::string text = std::string("{'descr': '") + traits(array.type).name +
                     "', 'fortran_order': False, 'shape': " + shape_text(array.shape) + ", }";
  const auto padded_length = [&](std::size_t preamble) {
    const std::size_t total = preamble + text.size() + 1;
    return (total + kNpyAlignment - 1) / kNpyAlignment * kNpyAlignment - preamble;
  };
  std::string preamble = "\x93NUMPY";
  std::size_t length = padded_length(10);
  int length_size = 2;
  if (length > std::numeric_limits<std::uint16_t>::max()) {
    length = padded_length(12);
    length_size = 4;
  }
  preamble += length_size == 2 ? '\1' : '\2';
  preamble += '\0';
  for (int i = 0; i < length_size; ++i) preamble += static_cast<char>((length >> (8 * i)) & 0xff);
  text.resize(length - 1, ' ');
  return preamble + text + '\n';
}

void check_size(const std::filesystem::path& path, const NumpyArray& array) {
  std::size_t size = traits(array.type).size;
  for (const std::size_t count : array.shape) size *= count;
  if (size != array.bytes.size()) {
    fail(path,
         "array " + array.name + " has a size that does not match its shape; correct the shape");
  }
}

/// A zip archive while it is written. It is discarded unless finish() is called.
class ZipWriter {
 public:
  ZipWriter(const std::filesystem::path& target, const std::filesystem::path& temporary)
      : target_(target) {
    int error = 0;
    archive_.reset(::zip_open(temporary.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &error));
    if (!archive_) {
      zip_error_t details;
      ::zip_error_init_with_code(&details, error);
      const std::string reason = ::zip_error_strerror(&details);
      ::zip_error_fini(&details);
      fail(target_, reason + "; choose another place to write to");
    }
  }

  /// Adds `header` and `data` as one file, uncompressed. Both are borrowed until finish().
  void add(const std::string& name, const std::string& header, std::span<const std::byte> data) {
    zip_source_t* source = make_source(header, data);
    const zip_int64_t index =
        ::zip_file_add(archive_.get(), name.c_str(), source, ZIP_FL_ENC_UTF_8);
    if (index < 0) {
      ::zip_source_free(source);
      fail_for_archive();
    }
    const auto entry = static_cast<zip_uint64_t>(index);
    if (::zip_set_file_compression(archive_.get(), entry, ZIP_CM_STORE, 0) != 0 ||
        ::zip_file_set_dostime(archive_.get(), entry, kZipTime, kZipDate, 0) != 0) {
      fail_for_archive();
    }
  }

  /// Writes everything that was added.
  void finish() {
    if (::zip_close(archive_.get()) != 0) fail_for_archive();
    static_cast<void>(archive_.release());  // zip_close has freed it
  }

 private:
  struct Discard {
    void operator()(zip_t* archive) const { ::zip_discard(archive); }
  };

  [[noreturn]] void fail_for_archive() const {
    fail(target_, std::string(::zip_strerror(archive_.get())) +
                      "; check the names of the arrays and the space on the disk");
  }

  zip_source_t* make_source(const std::string& header, std::span<const std::byte> data) {
    // libzip takes a non-const pointer because it can own the bytes. Here it does not own them and
    // only reads.
    const auto fragment = [](const void* bytes, std::size_t size) {
      return zip_buffer_fragment_t{static_cast<zip_uint8_t*>(const_cast<void*>(bytes)), size};
    };
    const std::array<zip_buffer_fragment_t, 2> fragments{
        {fragment(header.data(), header.size()), fragment(data.data(), data.size())}};
    const zip_uint64_t count = data.empty() ? 1 : 2;
    zip_source_t* source = ::zip_source_buffer_fragment(archive_.get(), fragments.data(), count, 0);
    if (source == nullptr) fail_for_archive();
    return source;
  }

  std::filesystem::path target_;
  std::unique_ptr<zip_t, Discard> archive_;
};

}  // namespace

void write_npz(const std::filesystem::path& path, std::span<const NumpyArray> arrays) {
  std::vector<std::string> headers;
  for (const NumpyArray& array : arrays) {
    check_size(path, array);
    headers.push_back(npy_header(array));
  }
  AtomicFile file(path);
  ZipWriter zip(path, file.path_for_library());
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    zip.add(arrays[i].name + ".npy", headers[i], arrays[i].bytes);
  }
  zip.finish();
  file.commit();
}

}  // namespace rebounce
