"""What the app uses of viser beyond its public interface; a test says when a release lacks a piece."""
