# One line a module; ``__init__.py`` reads this file to know where each public name lives.
