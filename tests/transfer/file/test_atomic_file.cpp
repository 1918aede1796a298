#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <stdexcept>

#include "tests/support/expect_error.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_folder.h"
#include "transfer/file/atomic_file.h"

namespace rebounce::test_atomic_file {
namespace {

using test::expect_error;
using Names = std::vector<std::string>;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

TEST(AtomicFile, AppearsOnCommitAndReplacesWhatWasThere) {
  const test::TemporaryFolder folder;
  test::write_bytes(folder / "file", "old and longer");
  {
    AtomicFile file(folder / "file");
    file.write(bytes_of("new "));
    file.write({});
    file.write(bytes_of("bytes"));
    EXPECT_EQ(test::read_bytes(folder / "file"), "old and longer");
    EXPECT_EQ(file.path_for_library().parent_path(), (folder / "file").parent_path());
    file.commit();
  }
  EXPECT_EQ(test::read_bytes(folder / "file"), "new bytes");
  EXPECT_EQ(folder.names(), Names{"file"});
}

TEST(AtomicFile, LeavesTheTargetAloneWhenAnExceptionPasses) {
  const test::TemporaryFolder folder;
  test::write_bytes(folder / "file", "old");
  try {
    AtomicFile file(folder / "file");
    file.write(bytes_of("half"));
    throw std::runtime_error("elsewhere");
  } catch (const std::runtime_error&) {
  }
  EXPECT_EQ(test::read_bytes(folder / "file"), "old");
  EXPECT_EQ(folder.names(), Names{"file"});
}

TEST(AtomicFile, ReportsAFullDisk) {
  const test::TemporaryFolder folder;
  test::write_bytes(folder / "file", "old");
  {
    const test::FileSizeLimit limit(4096);
    expect_error(
        [&] {
          AtomicFile file(folder / "file");
          file.write(bytes_of(std::string(10'000, 'x')));
          file.commit();
        },
        "cannot write " + (folder / "file").string());
  }
  EXPECT_EQ(test::read_bytes(folder / "file"), "old");
  EXPECT_EQ(folder.names(), Names{"file"});
}

TEST(AtomicFile, RefusesAMissingFolderAFolderAndADevice) {
  const test::TemporaryFolder folder;
  expect_error([&] { AtomicFile(folder / "none/file"); }, "create the folder first");
  std::filesystem::create_directory(folder / "folder");
  expect_error([&] { AtomicFile(folder / "folder"); }, "not a regular file");
  expect_error([&] { AtomicFile(folder / "folder/"); }, "not a regular file");
  expect_error([&] { AtomicFile("/dev/null"); }, "not a regular file");
  expect_error([&] { AtomicFile(""); }, "not a regular file");
  EXPECT_EQ(folder.names(), Names{"folder"});
}

TEST(AtomicFile, WritesThroughASymbolicLink) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "elsewhere");
  test::write_bytes(folder / "elsewhere/file", "old");
  std::filesystem::create_symlink(folder / "elsewhere/file", folder / "link");
  {
    AtomicFile file(folder / "link");
    file.write(bytes_of("new"));
    file.commit();
  }
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  // Links to a link to a file that does not exist.
  std::filesystem::create_symlink("elsewhere/new", folder / "first");
  std::filesystem::create_symlink(folder / "first", folder / "second");
  AtomicFile(folder / "second").commit();
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "first"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "second"));
  EXPECT_TRUE(std::filesystem::is_regular_file(folder / "elsewhere/new"));
  std::filesystem::create_symlink("circle", folder / "circle");
  test::expect_error([&] { AtomicFile file(folder / "circle"); }, "circle: Too many levels");
  EXPECT_EQ(test::read_bytes(folder / "elsewhere/file"), "new");
}

TEST(AtomicFile, TwoAtOnceDoNotMeet) {
  const test::TemporaryFolder folder;
  AtomicFile first(folder / "file");
  AtomicFile second(folder / "file");
  first.write(bytes_of("first"));
  second.write(bytes_of("second"));
  second.commit();
  first.commit();
  EXPECT_EQ(test::read_bytes(folder / "file"), "first");
}

TEST(AtomicFile, RemovesWhatKilledProcessesLeft) {
  const test::TemporaryFolder folder;
  for (const char* name : {".file.rebounce-123-1.tmp", ".file.rebounce-123-2.tmp.library",
                           ".file.rebounce-45-6.tmp.library.aB3", ".file.rebounce-7-1.tmp",
                           ".file.rebounce-7-1.tmp.library"})
    test::write_bytes(folder / name, "half");
  const Names others{".file.tmp", ".file.123-1.tmp", ".file.rebounce-a-1.tmp",
                     ".file2.rebounce-123-1.tmp", "file.rebounce-123-1.tmp"};
  for (const std::string& name : others) test::write_bytes(folder / name, "mine");
  { const AtomicFile never_committed(folder / "file"); }
  for (const std::string& name : others) {
    EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
  }
  EXPECT_EQ(folder.names().size(), others.size());
}

TEST(AtomicFile, LeavesWhatOthersWriteAlone) {
  const test::TemporaryFolder folder;
  AtomicFile first(folder / "file");
  test::write_bytes(first.path_for_library(), "of a library");
  { const AtomicFile never_committed(folder / "file"); }
  EXPECT_TRUE(std::filesystem::exists(first.path_for_library()));
  first.commit();
  EXPECT_EQ(test::read_bytes(folder / "file"), "of a library");
}

TEST(AtomicFile, TakesWhatALibraryWrote) {
  const test::TemporaryFolder folder;
  {
    AtomicFile file(folder / "file");
    test::write_bytes(file.path_for_library(), "of a library");
    file.commit();
  }
  EXPECT_EQ(test::read_bytes(folder / "file"), "of a library");
  EXPECT_EQ(folder.names(), Names{"file"});
  {
    AtomicFile given_up(folder / "file");
    test::write_bytes(given_up.path_for_library(), "half");
  }
  EXPECT_EQ(folder.names(), Names{"file"});
}

TEST(AtomicFile, NeedsNoRightToListTheFolder) {
  namespace fs = std::filesystem;
  const test::TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms::all);
  fs::create_directory(folder / "box");
  fs::permissions(folder / "box", fs::perms(0333));
  const uid_t user = ::geteuid();
  constexpr uid_t kNobody = 65534;
  ASSERT_EQ(::seteuid(user == 0 ? kNobody : user), 0);  // the superuser may read anything
  EXPECT_LT(::open((folder / "box").c_str(), O_RDONLY | O_DIRECTORY), 0);
  EXPECT_NO_THROW({
    AtomicFile file(folder / "box/file");
    file.write(bytes_of("new"));
    file.commit();
  });
  ASSERT_EQ(::seteuid(user), 0);
  fs::permissions(folder / "box", fs::perms::all);
  EXPECT_EQ(test::read_bytes(folder / "box/file"), "new");
}

TEST(AtomicFile, HasTheRightsOfAnOrdinaryFile) {
  const test::TemporaryFolder folder;
  const mode_t mask = ::umask(022);
  {
    AtomicFile file(folder / "file");
    file.commit();
  }
  ::umask(mask);
  EXPECT_EQ(static_cast<unsigned>(std::filesystem::status(folder / "file").permissions()), 0644U);
}

}  // namespace
}  // namespace rebounce::test_atomic_file
