"""What people take away: pictures for papers, data, tables, reports, and all of it in one ZIP file."""
