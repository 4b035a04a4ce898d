"""PostgreSQL: connections, column types, migrations, the embedded server. No business words."""
